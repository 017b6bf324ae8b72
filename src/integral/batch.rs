//! Many pieces at a time: the same arithmetic as [`Piece::new`], in vector instructions.

use super::{Exact, GAUSS_DEPTH, Light, Piece, SERIES_DEPTH};

/// Pieces that a [`Batch`] holds.
const BATCH: usize = 32;

/// Pieces of one ray, in order, that wait to be integrated side by side.
#[derive(Debug, Clone)]
pub struct Batch {
    len: usize,
    length: [f32; BATCH],
    front: [[f32; 4]; BATCH],
    back: [[f32; 4]; BATCH],
}

impl Default for Batch {
    fn default() -> Self {
        Batch { len: 0, length: [0.0; BATCH], front: [[0.0; 4]; BATCH], back: [[0.0; 4]; BATCH] }
    }
}

impl Batch {
    /// Forgets all pieces.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Takes a segment; what does not fit any more goes to `light`.
    #[inline(always)]
    pub fn add<const N: usize>(
        &mut self,
        exact: &Exact<f32>,
        front: &[f32; N],
        back: &[f32; N],
        length: f32,
        light: &mut Light<f32>,
    ) {
        exact.for_each_piece(front, back, |f, b, share| {
            if self.len == BATCH {
                self.flush(exact.direct, light);
            }
            self.length[self.len] = share * length;
            (self.front[self.len], self.back[self.len]) = (f, b);
            self.len += 1;
        });
    }

    /// Adds all pieces to `light` and forgets them.
    pub fn flush(&mut self, direct: bool, light: &mut Light<f32>) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            #[target_feature(enable = "avx2")]
            fn wide(batch: &mut Batch, direct: bool, light: &mut Light<f32>) {
                batch.integrate(direct, light);
            }
            #[allow(unsafe_code, reason = "vector instructions that the processor was just asked about")]
            // SAFETY: the processor has AVX2.
            return unsafe { wide(self, direct, light) };
        }
        self.integrate(direct, light);
    }

    #[inline(always)]
    fn integrate(&mut self, direct: bool, light: &mut Light<f32>) {
        let (mut x, mut y) = ([0.0; BATCH], [0.0; BATCH]);
        let pieces = self.front.iter().zip(&self.back).zip(&self.length).take(self.len);
        for (((front, back), length), (x, y)) in pieces.clone().zip(x.iter_mut().zip(&mut y)) {
            // What is below 0 is rounding, much of it beside great depths.
            (*x, *y) = ((front[0] * length).max(0.0), (back[0] * length).max(0.0));
        }
        let all_thin = x.iter().zip(&y).all(|(x, y)| x.max(*y) <= SERIES_DEPTH as f32);
        let computed = match (all_thin, direct) {
            (true, false) => many(&x, &y, self.len, |x, y| Piece::by_series(x, y, false)),
            (true, true) => many(&x, &y, self.len, |x, y| Piece::by_series(x, y, true)),
            (false, false) => many(&x, &y, self.len, |x, y| Piece::by_gauss(x, y, false)),
            (false, true) => many(&x, &y, self.len, |x, y| Piece::by_gauss(x, y, true)),
        };
        for (i, ((f, b), length)) in pieces.enumerate() {
            let piece = if x[i].max(y[i]) > GAUSS_DEPTH as f32 {
                Piece::new(x[i], y[i], direct)
            } else {
                Piece { alpha: computed[0][i], front: computed[1][i], back: computed[2][i] }
            };
            let l = if direct { *length } else { 1.0 };
            light.add([1, 2, 3].map(|k| (f[k] * piece.front + b[k] * piece.back) * l), piece.alpha);
        }
        self.len = 0;
    }
}

/// α, front and back of the first `len` pieces, and some more.
#[inline(always)]
fn many(x: &[f32; BATCH], y: &[f32; BATCH], len: usize, piece: impl Fn(f32, f32) -> Piece<f32>) -> [[f32; BATCH]; 3] {
    let [mut alpha, mut front, mut back] = [[0.0; BATCH]; 3];
    // Whole vectors, and never beyond the arrays, which is what the compiler must see.
    for i in 0..len.next_multiple_of(8).min(BATCH) {
        let piece = piece(x[i], y[i]);
        (alpha[i], front[i], back[i]) = (piece.alpha, piece.front, piece.back);
    }
    [alpha, front, back]
}
