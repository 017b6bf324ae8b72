//! Tables of fields whose colours have components of their own: the twin of what `shaders/table.wgsl` does for such.
//!
//! The table knows the weights of the colours at a segment's two ends ([`Exact::weights`]), between which colours are linear. So they are
//! along a segment of an RGBA field; of a pair, the segment is cut where its first component crosses a knot of the function of colour.

use super::{PreintegratedTable, WITHIN};
use crate::integral::knots::Track;
use crate::integral::{Exact, Light, Piece};

impl PreintegratedTable {
    /// Adds a segment of `length` to `light`. Values that are not finite make it invisible. Where the component that opacity is of is
    /// beyond ±1 the function is constant: that part of a segment is integrated exactly. `N` is the number of the field's components,
    /// those that the table was built for.
    #[inline]
    pub fn add_components<const N: usize>(
        &self,
        exact: &Exact<f32>,
        front: &[f32; N],
        back: &[f32; N],
        length: f32,
        light: &mut Light<f32>,
    ) {
        if N == 1 {
            return self.add(exact, front[0], back[0], length, light);
        }
        if !front.iter().chain(back).all(|v| v.is_finite()) {
            return;
        }
        let ends = [front[N - 1], back[N - 1]];
        let Some(color) = &exact.color else {
            let colors = [front, back].map(|v| [v[0], v[1 % N], v[2 % N]].map(|c| c * exact.scale));
            return self.add_linear(exact, ends, colors, length, light);
        };
        let mut track = Track::new(color, front[0], back[0]);
        let (mut at, rise) = (ends[0], ends[1] - ends[0]);
        loop {
            let (to, is_last) = track.next();
            let share = track.share_to((to, true)).unwrap_or(1.0);
            if share > 0.0 {
                let end = if is_last { ends[1] } else { ends[0] + rise * track.share_before(to) };
                let colors = [track.line(track.at), track.line(to)].map(|[_, r, g, b]| [r, g, b]);
                self.add_linear(exact, [at, end], colors, share * length, light);
                at = end;
            }
            track.move_to((to, true));
            if is_last || !track.advance() {
                return;
            }
        }
    }

    /// Adds a segment whose colours are linear from the first of `colors` to the second; opacity is that of values between `ends`.
    #[inline]
    fn add_linear(
        &self,
        exact: &Exact<f32>,
        [front, back]: [f32; 2],
        [first, last]: [[f32; 3]; 2],
        length: f32,
        light: &mut Light<f32>,
    ) {
        let mut add = |weights: [f32; 3], [first, last]: [[f32; 3]; 2]| {
            let [behind, before, alpha] = weights;
            light.add(std::array::from_fn(|k| first[k] * before + last[k] * behind), alpha);
        };
        if front.abs().max(back.abs()) <= WITHIN {
            let [behind, before, _, alpha] = self.look_up(front, back, length);
            return add([behind, before, alpha], [first, last]);
        }
        let outside = |s: f32, length: f32| {
            let knots = &exact.opacity.value;
            let [tau, ..] = knots[if s > 0.0 { knots.len() - 1 } else { 0 }];
            let piece = Piece::new(tau * length, tau * length, exact.direct);
            let unit = if exact.direct { length } else { 1.0 };
            [piece.back * unit, piece.front * unit, piece.alpha]
        };
        let (near, far) = (front.clamp(-1.0, 1.0), back.clamp(-1.0, 1.0));
        if near == far {
            return add(outside(front, length), [first, last]);
        }
        let share = |s: f32| (s - front) / (back - front);
        let color = |s: f32| std::array::from_fn(|k| first[k] + (last[k] - first[k]) * share(s));
        let part = |from: f32, to: f32| (to - from) / (back - front) * length;
        let (enter, leave) = (color(near), color(far));
        if front != near {
            add(outside(front, part(front, near)), [first, enter]);
        }
        let [behind, before, _, alpha] = self.look_up(near, far, part(near, far));
        add([behind, before, alpha], [enter, leave]);
        if back != far {
            add(outside(back, part(far, back)), [leave, last]);
        }
    }
}
