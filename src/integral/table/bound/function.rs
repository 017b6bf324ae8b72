//! What bounds know of the transfer function: of each interval between two values of a table.

use crate::integral::Knots;

/// What is known of the function between two values, and around them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Interval {
    pub(super) gap: f64,
    pub(super) shift: f64,
    pub(super) gap_colour: f64,
    pub(super) shift_colour: f64,
    pub(super) least: f64,
    pub(super) most: f64,
    /// Between the two values themselves: gaps, and from what to what extinction and colours go.
    pub(super) own_gap: f64,
    pub(super) own_gap_colour: f64,
    pub(super) own: [[f64; 2]; 4],
    /// By how much the chord of the integral of extinction is off, and its rise.
    pub(super) bend: f64,
    pub(super) rise: f64,
    pub(super) end: End,
    /// The kink of extinction at the lower value, a quarter of its change of slope per texel; endless if it is a step.
    /// And gaps there.
    pub(super) kink: f64,
    pub(super) between: [f64; 2],
}

/// What is known of the function where segments of a cell end: the greatest extinction, and slopes of extinction and
/// colours per texel, endless if there is a step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct End {
    pub(super) most: f64,
    pub(super) slope: f64,
    pub(super) slope_colour: f64,
}

/// What bounds need to know of the `n` intervals.
pub(super) fn intervals(knots: &Knots<f64>, n: usize) -> Vec<Interval> {
    // Of all channels: kinks and steps inside of an interval and at its lower end, the greatest slope, least and most.
    let mut inside = vec![[0.0f64; 4]; n];
    let mut at_end = vec![[0.0f64; 4]; n];
    let mut steep = vec![[0.0f64; 4]; n];
    let mut range = vec![[[f64::INFINITY, f64::NEG_INFINITY]; 4]; n];
    let mut rise = vec![0.0f64; n];
    let mut stepped = vec![[false; 4]; n];
    // From what to what steps at the values go: a texel may hold either.
    let mut steps = vec![[[f64::INFINITY, f64::NEG_INFINITY]; 4]; n + 1];
    let per_texel = 2.0 / n as f64;
    let place = |s: f64| (s + 1.0) / per_texel;
    for (k, s) in knots.s.windows(2).enumerate() {
        let [x0, x1] = [s[0], s[1]].map(|s| place(s.clamp(-1.0, 1.0)));
        let value = |c: usize, x: f64| knots.value[k][c] + knots.slope[k][c] * (x * per_texel - 1.0 - s[0]);
        for i in (x0 as usize)..(x1.ceil() as usize).min(n) {
            let ends = [x0.max(i as f64), x1.min(i as f64 + 1.0)];
            if ends[0] < ends[1] {
                rise[i] += (ends[1] - ends[0]) * (value(0, ends[0]) + value(0, ends[1])) / 2.0;
            }
            for c in (0..4).filter(|_| ends[0] < ends[1]) {
                for v in ends.map(|x| value(c, x)) {
                    range[i][c] = [range[i][c][0].min(v), range[i][c][1].max(v)];
                }
                steep[i][c] = steep[i][c].max((knots.slope[k][c] * per_texel).abs());
            }
        }
        let node = (x0 - x0.round()).abs() < 1e-9;
        if node && s[0] == s[1] {
            let m = x0.round() as usize;
            for (c, step) in steps[m].iter_mut().enumerate() {
                *step = [knots.value[k][c], knots.value[k + 1][c]]
                    .iter()
                    .fold(*step, |[lo, hi], &v| [lo.min(v), hi.max(v)]);
            }
        }
        if k == 0 || s[0] <= -1.0 || s[0] >= 1.0 {
            continue;
        }
        if !node && s[0] == s[1] {
            for (c, stepped) in stepped[x0 as usize].iter_mut().enumerate() {
                *stepped |= knots.value[k + 1][c] != knots.value[k][c];
            }
        }
        let of = if node { &mut at_end[(x0.round() as usize).min(n - 1)] } else { &mut inside[x0 as usize] };
        for (c, of) in of.iter_mut().enumerate() {
            *of += match s[0] < s[1] {
                true => ((knots.slope[k][c] - knots.slope[k - 1][c]) * per_texel).abs() / 4.0,
                false => {
                    (knots.value[k + 1][c] - knots.value[k][c]).abs() + (knots.slope[k - 1][c] * per_texel).abs() / 4.0
                }
            };
        }
    }
    let interval = |i: usize| {
        let around = i.saturating_sub(1)..(i + 2).min(n);
        let hull = |c: usize| {
            let ranges = around.clone().map(|k| range[k][c]);
            ranges.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], [a, b]| [lo.min(a), hi.max(b)])
        };
        let gap = |c: usize| {
            let between: f64 = around.clone().skip(usize::from(i > 0)).map(|k| at_end[k][c]).sum();
            let [lo, hi] = hull(c);
            (around.clone().map(|k| inside[k][c]).sum::<f64>() + between).min(hi - lo)
        };
        let shift = |c: usize| {
            let [lo, hi] = hull(c);
            let steps: f64 = around.clone().map(|k| inside[k][c] + at_end[k][c]).sum();
            (around.clone().fold(0.0f64, |m, k| m.max(steep[k][c])) + steps).min(hi - lo)
        };
        let colours = |of: &dyn Fn(usize) -> f64| (1..4).map(of).fold(0.0, f64::max);
        let [least, most] = hull(0);
        let (gap_colour, shift_colour) = (colours(&gap), colours(&shift));
        let ends = [&steps[i], &steps[i + 1]];
        let own: [[f64; 2]; 4] = std::array::from_fn(|c| {
            ends.iter().fold(range[i][c], |[lo, hi], step| [lo.min(step[c][0]), hi.max(step[c][1])])
        });
        let own_gap = |c: usize| {
            let steps: f64 = ends.iter().map(|step| (step[c][1] - step[c][0]).max(0.0)).sum();
            (inside[i][c] + steps).min(own[c][1] - own[c][0])
        };
        let varied = range[i][0][1] - range[i][0][0];
        Interval {
            gap: gap(0),
            shift: shift(0),
            gap_colour,
            shift_colour,
            least,
            most,
            own_gap: own_gap(0),
            own_gap_colour: colours(&own_gap),
            own,
            bend: varied / if inside[i][0] > 0.0 { 4.0 } else { 8.0 },
            rise: rise[i],
            end: End {
                most: own[0][1],
                slope: if stepped[i][0] { f64::INFINITY } else { steep[i][0] },
                slope_colour: colours(&|c| if stepped[i][c] { f64::INFINITY } else { steep[i][c] }),
            },
            kink: if steps[i][0][1] > steps[i][0][0] { f64::INFINITY } else { at_end[i][0] },
            between: [at_end[i][0], colours(&|c| at_end[i][c])],
        }
    };
    (0..n).map(interval).collect()
}
