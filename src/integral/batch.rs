//! Many pieces at a time: the same arithmetic as [`Piece::new`], in vector instructions.

use super::{Exact, Light, PANEL, Piece};

/// Pieces that a [`Batch`] holds.
const BATCH: usize = 32;

/// Pieces of one ray, in order, that wait to be integrated side by side.
#[derive(Debug, Clone)]
pub struct Batch {
    len: usize,
    length: [f32; BATCH],
    front: [[f32; BATCH]; 4],
    back: [[f32; BATCH]; 4],
}

impl Default for Batch {
    fn default() -> Self {
        Batch { len: 0, length: [0.0; BATCH], front: [[0.0; BATCH]; 4], back: [[0.0; BATCH]; 4] }
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
            for k in 0..4 {
                self.front[k][self.len] = f[k];
                self.back[k][self.len] = b[k];
            }
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
        let mut pieces = [[0.0; BATCH]; 3];
        if direct {
            self.moderate::<true>(&mut pieces);
        } else {
            self.moderate::<false>(&mut pieces);
        }
        #[expect(clippy::needless_range_loop, reason = "i runs over seven arrays at once")]
        for i in 0..self.len {
            let length = self.length[i];
            let (x, y) = (self.front[0][i] * length, self.back[0][i] * length);
            let piece = if x.max(y) > PANEL as f32 {
                Piece::new(x, y, direct)
            } else {
                Piece { alpha: pieces[0][i], front: pieces[1][i], back: pieces[2][i] }
            };
            let l = if direct { length } else { 1.0 };
            light.add(
                [1, 2, 3].map(|k| (self.front[k][i] * piece.front + self.back[k][i] * piece.back) * l),
                piece.alpha,
            );
        }
        self.len = 0;
    }

    /// [`Piece::moderate`] of the whole batch, in groups of eight.
    #[inline(always)]
    fn moderate<const DIRECT: bool>(&self, [alpha, front, back]: &mut [[f32; BATCH]; 3]) {
        for i in 0..self.len.next_multiple_of(8) {
            let (x, y) = (self.front[0][i] * self.length[i], self.back[0][i] * self.length[i]);
            let piece = Piece::moderate(x, y, DIRECT);
            (alpha[i], front[i], back[i]) = (piece.alpha, piece.front, piece.back);
        }
    }
}
