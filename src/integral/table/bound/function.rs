//! What bounds know of the transfer function: of each interval between two values of a table.

use crate::integral::Knots;

/// What is known of the function between two values: `bound.rs` defines gaps and shifts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct KnotInterval {
    /// Of segments that come here, and whose neighbours reach a texel farther: of extinction, and of colours.
    pub(super) gap: f64,
    pub(super) shift: f64,
    pub(super) gap_colour: f64,
    pub(super) shift_colour: f64,
    /// From what to what extinction goes where those are.
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
    /// At the lower value: gaps of extinction and of colours, and that of extinction's kink, endless if it is a step.
    pub(super) below: [f64; 2],
    pub(super) kink: f64,
}

/// What is known of the function where segments of a cell end: the greatest extinction, and slopes of extinction and
/// colours per texel, endless if there is a step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct End {
    pub(super) most: f64,
    pub(super) slope: f64,
    pub(super) slope_colour: f64,
}

/// Least and greatest of nothing.
const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// One of extinction, red, green and blue in an interval.
#[derive(Debug, Clone, Copy)]
struct Channel {
    /// From what to what it goes; which steps at the two values are no part of.
    range: [f64; 2],
    /// The greatest slope per texel.
    slope: f64,
    /// Between the values, and at the lower one.
    within: Turns,
    below: Turns,
}

/// What is not linear: a quarter of the changes of slope per texel, and the heights of steps.
#[derive(Debug, Clone, Copy, Default)]
struct Turns {
    kinks: f64,
    steps: f64,
}

impl Turns {
    fn gap(&self) -> f64 {
        self.kinks + self.steps
    }
}

/// The function in the intervals of a table.
struct Sampled {
    channels: Vec<[Channel; 4]>,
    /// At each value from what to what steps go: a texel may hold either.
    steps: Vec<[[f64; 2]; 4]>,
    /// Integrals of extinction.
    rise: Vec<f64>,
}

fn hull(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// The greatest of the colours.
fn colours(of: impl Fn(usize) -> f64) -> f64 {
    (1..4).map(of).fold(0.0, f64::max)
}

impl Sampled {
    fn new(knots: &Knots<f64>, n: usize) -> Self {
        let none = Channel { range: NOTHING, slope: 0.0, within: Turns::default(), below: Turns::default() };
        let mut all = Sampled { channels: vec![[none; 4]; n], steps: vec![[NOTHING; 4]; n + 1], rise: vec![0.0; n] };
        let per_texel = 2.0 / n as f64;
        let place = |s: f64| (s.clamp(-1.0, 1.0) + 1.0) / per_texel;
        for (k, s) in knots.s.windows(2).enumerate() {
            let [x0, x1] = [s[0], s[1]].map(place);
            let value = |c: usize, x: f64| knots.value[k][c] + knots.slope[k][c] * (x * per_texel - 1.0 - s[0]);
            for i in (x0 as usize)..(x1.ceil() as usize).min(n) {
                let ends = [x0.max(i as f64), x1.min(i as f64 + 1.0)];
                if ends[0] >= ends[1] {
                    continue;
                }
                all.rise[i] += (ends[1] - ends[0]) * (value(0, ends[0]) + value(0, ends[1])) / 2.0;
                for (c, of) in all.channels[i].iter_mut().enumerate() {
                    of.range = ends.map(|x| value(c, x)).iter().fold(of.range, |range, &v| hull(range, [v; 2]));
                    of.slope = of.slope.max((knots.slope[k][c] * per_texel).abs());
                }
            }
            all.turn(knots, k, x0, per_texel);
        }
        all
    }

    /// Notes how the function turns at knot `k`, which is at `x`.
    fn turn(&mut self, knots: &Knots<f64>, k: usize, x: f64, per_texel: f64) {
        let n = self.channels.len();
        let (is_value, is_step) = ((x - x.round()).abs() < 1e-9, knots.s[k] == knots.s[k + 1]);
        let ends = |c: usize| [knots.value[k][c], knots.value[(k + 1).min(knots.value.len() - 1)][c]];
        if is_value && is_step {
            for (c, step) in self.steps[x.round() as usize].iter_mut().enumerate() {
                *step = ends(c).iter().fold(*step, |step, &v| hull(step, [v; 2]));
            }
        }
        if k == 0 || knots.s[k] <= -1.0 || knots.s[k] >= 1.0 {
            return;
        }
        let i = if is_value { x.round() } else { x } as usize;
        for (c, channel) in self.channels[i.min(n - 1)].iter_mut().enumerate() {
            let of = if is_value { &mut channel.below } else { &mut channel.within };
            // A step has no slope itself.
            of.kinks += ((knots.slope[k][c] - knots.slope[k - 1][c]) * per_texel).abs() / 4.0;
            if is_step {
                of.steps += (ends(c)[1] - ends(c)[0]).abs();
            }
        }
    }

    fn interval(&self, i: usize) -> KnotInterval {
        let own = &self.channels[i];
        let around = &self.channels[i.saturating_sub(1)..(i + 2).min(self.channels.len())];
        let reach = |c: usize| around.iter().fold(NOTHING, |range, of| hull(range, of[c].range));
        let varies = |c: usize| reach(c)[1] - reach(c)[0];
        let gap = |c: usize| {
            let below = around.iter().skip(usize::from(i > 0)).map(|of| of[c].below.gap());
            (around.iter().map(|of| of[c].within.gap()).sum::<f64>() + below.sum::<f64>()).min(varies(c))
        };
        let shift = |c: usize| {
            let steps: f64 = around.iter().map(|of| of[c].within.steps + of[c].below.steps).sum();
            (around.iter().fold(0.0, |m: f64, of| m.max(of[c].slope)) + steps).min(varies(c))
        };
        let steps = |c: usize| [self.steps[i][c], self.steps[i + 1][c]];
        let own_range = |c: usize| steps(c).into_iter().fold(own[c].range, hull);
        let own_gap = |c: usize| {
            let steps: f64 = steps(c).iter().map(|[lo, hi]| (hi - lo).max(0.0)).sum();
            (own[c].within.gap() + steps).min(own_range(c)[1] - own_range(c)[0])
        };
        let slope = |c: usize| if own[c].within.steps > 0.0 { f64::INFINITY } else { own[c].slope };
        let ([least, most], [low, high]) = (reach(0), own[0].range);
        KnotInterval {
            gap: gap(0),
            shift: shift(0),
            gap_colour: colours(gap),
            shift_colour: colours(shift),
            least,
            most,
            own_gap: own_gap(0),
            own_gap_colour: colours(own_gap),
            own: [0, 1, 2, 3].map(own_range),
            bend: (high - low) / if own[0].within.gap() > 0.0 { 4.0 } else { 8.0 },
            rise: self.rise[i],
            end: End { most: own_range(0)[1], slope: slope(0), slope_colour: colours(slope) },
            below: [own[0].below.gap(), colours(|c| own[c].below.gap())],
            kink: if own[0].below.steps > 0.0 { f64::INFINITY } else { own[0].below.kinks },
        }
    }
}

/// What bounds need to know of the `n` intervals between the values of a table.
pub(super) fn intervals(knots: &Knots<f64>, n: usize) -> Vec<KnotInterval> {
    let sampled = Sampled::new(knots, n);
    (0..n).map(|i| sampled.interval(i)).collect()
}
