//! The range that colours and opacities are spread over when nobody says.

use crate::field::{Association, Component};
use crate::mesh::cells::Tetrahedra;
use crate::mesh::{Array, Mesh};
use crate::scene::Scalars;

/// Values that are sorted, at most.
const SAMPLES: usize = 1 << 18;

/// What programs write where there is no value (climate and geophysics conventions, limits of number types).
const FILLS: [f64; 22] = [
    999.0,
    999.25,
    9999.0,
    99999.0,
    999999.0,
    9999999.0,
    32767.0,
    32768.0,
    2147483647.0,
    2147483648.0,
    1e20,
    1e30,
    1e31,
    1e33,
    1e34,
    1e35,
    1e36,
    1e37,
    1e38,
    9.969209968386869e36,
    f32::MAX as f64,
    f64::MAX,
];

/// Such a value may fill this share of the mesh; another that repeats, or values that do not, less.
const MOST_FILLED: f64 = 0.9;
const MOST_EQUAL: f64 = 0.1;
const MOST_APART: f64 = 0.01;

/// How much wider than the rest the gap is that parts outliers from it; and fill values.
const GAP: f64 = 10.0;
const FILL_GAP: f64 = 0.5;

/// Values of fewer points or cells may be anything.
const FEWEST: usize = 8;

/// Smallest and largest value of the points and cells that are drawn, fill values and outliers apart; and what was left
/// apart, for the log. None if `scalars` are not of the mesh, or no value is finite.
pub fn range(mesh: &Mesh, tetrahedra: &Tetrahedra, scalars: &Scalars) -> Option<([f64; 2], String)> {
    let values = drawn(mesh, tetrahedra, scalars)?;
    let [lo, hi] = extremes(values.iter().copied())?;
    let range = trimmed(&values);
    let apart = values.iter().filter(|v| **v < range[0] || **v > range[1]).count();
    let note = match apart {
        0 => "the values of what is drawn".to_owned(),
        _ => format!("{apart} of {} values of what is drawn are apart, from {lo} to {hi}", values.len()),
    };
    Some((range, note))
}

/// The finite values of points or cells that are drawn.
fn drawn(mesh: &Mesh, tetrahedra: &Tetrahedra, scalars: &Scalars) -> Option<Vec<f64>> {
    let points = mesh.point_arrays().iter().map(|array| (Association::Point, array));
    let cells = mesh.cell_arrays().iter().map(|array| (Association::Cell, array));
    let mut arrays = points.chain(cells).filter(|(of, _)| scalars.association.is_none_or(|wanted| wanted == *of));
    let (association, array) = arrays.find(|(_, array)| array.name == scalars.name)?;
    let mut used = vec![false; array.tuples()];
    let mut mark = |i: u32| {
        if let Some(used) = used.get_mut(i as usize) {
            *used = true;
        }
    };
    match (association, &tetrahedra.cell) {
        (Association::Point, _) => {
            tetrahedra.corners.as_flattened().iter().for_each(|point| mark(*point));
            tetrahedra.added.sources.iter().for_each(|point| mark(*point));
        }
        (Association::Cell, Some(cells)) => cells.iter().for_each(|cell| mark(*cell)),
        (Association::Cell, None) => used.fill(true),
    }
    let value = |i: usize| value(array, scalars.component, i);
    let used = used.into_iter().enumerate().filter(|(_, used)| *used);
    Some(used.map(|(i, _)| value(i)).filter(|v| v.is_finite()).collect())
}

fn value(array: &Array, component: Option<Component>, i: usize) -> f64 {
    let n = array.components;
    let one = |k: usize| array.values.get(i * n + k);
    match component {
        Some(Component::Index(k)) if k < n => one(k),
        None | Some(Component::Magnitude) if n > 1 => (0..n).fold(0.0, |m: f64, k| m.hypot(one(k))),
        Some(Component::Magnitude) => one(0).abs(),
        _ => one(0),
    }
}

fn extremes(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let range = values.fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(v), r[1].max(v)]);
    (range[0] <= range[1]).then_some(range)
}

/// The range without what lies apart at its ends.
fn trimmed(values: &[f64]) -> [f64; 2] {
    let step = values.len().div_ceil(SAMPLES).max(1);
    // Both are beyond what is kept.
    let (mut below, mut above) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut range = [0.0; 2];
    // Each turn cuts a group off; more would be none that anybody meant.
    for _ in 0..32 {
        let kept = |v: &f64| below < *v && *v < above;
        let Some([lo, hi]) = extremes(values.iter().copied().filter(kept)) else { break };
        range = [lo, hi];
        let mut sample: Vec<f64> = values.iter().copied().step_by(step).filter(kept).collect();
        // The extremes of all values are a part of any sample.
        sample.extend([lo, hi].into_iter().filter(|_| step > 1));
        sample.sort_by(f64::total_cmp);
        if let Some(first) = apart(&sample) {
            above = first;
        } else {
            let mirrored: Vec<f64> = sample.iter().rev().map(|v| -v).collect();
            match apart(&mirrored) {
                Some(first) => below = -first,
                None => return shown(&sample),
            }
        }
    }
    range
}

/// The first of the values at the upper end of `sorted` that are apart from the rest, if there are any.
fn apart(sorted: &[f64]) -> Option<f64> {
    let n = sorted.len();
    let last = *sorted.last()?;
    // Outliers at the other end must not hide those at this one.
    let spread = |end: usize| sorted[end] - sorted[(n / 50).max(1).min(end / 2)];
    let gap = |start: usize| sorted[start] - sorted[start - 1];
    let share = |start: usize| (n - start) as f64 / n as f64;
    let equal = sorted.partition_point(|v| *v < last);
    if equal == 0 {
        return None;
    }
    let is_fill = FILLS.iter().any(|fill| (last.abs() / fill - 1.0).abs() < 1e-6);
    if is_fill && share(equal) <= MOST_FILLED && gap(equal) >= FILL_GAP * spread(equal - 1) {
        return Some(last);
    }
    let few = |start: usize, most: f64| n - start <= 1 || share(start) <= most;
    let far = |start: usize| spread(start - 1) > 0.0 && gap(start) >= GAP * spread(start - 1);
    if n < FEWEST {
        return None;
    }
    if few(equal, MOST_EQUAL) && far(equal) {
        return Some(last);
    }
    (1..n).rev().take_while(|start| few(*start, MOST_APART)).filter(|start| far(*start)).last().map(|i| sorted[i])
}

/// All of the range, unless the few values at its ends stretch it: then a little more than what most lie in.
fn shown(sorted: &[f64]) -> [f64; 2] {
    let quantile = |q: f64| sorted[((sorted.len() - 1) as f64 * q) as usize];
    let (lo, hi, a, b) = (quantile(0.0), quantile(1.0), quantile(0.01), quantile(0.99));
    if sorted.len() >= FEWEST && b > a && hi / 4.0 - lo / 4.0 > b - a {
        let margin = (b - a) / 10.0;
        return [lo.max(a - margin), hi.min(b + margin)];
    }
    [lo, hi]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Values, generate};

    fn ramp(n: usize) -> Vec<f64> {
        (0..n).map(|i| 273.0 + 30.0 * i as f64 / (n - 1) as f64).collect()
    }

    #[test]
    fn fill_values_and_outliers_are_apart() {
        for n in [8, 27, 1000, 400_000] {
            let plain = ramp(n);
            assert_eq!(trimmed(&plain), [273.0, 303.0]);
            // Sorting many takes long.
            for exponent in (4..=38).step_by(if n > 1000 { 17 } else { 1 }) {
                for sign in [-1.0, 1.0] {
                    // One, and where there are many, a fiftieth.
                    for each in [n, 50] {
                        let mut values = plain.clone();
                        values.iter_mut().skip(n / 2).step_by(each).for_each(|v| *v = sign * 10f64.powi(exponent));
                        let [lo, hi] = trimmed(&values);
                        assert!((lo, hi) == (273.0, 303.0), "{n} {exponent} {sign} {each}: {lo} {hi}");
                    }
                }
            }
            let mut values = plain.clone();
            values[n / 2] = -9999.0;
            values[n / 2 + 1] = 1e20;
            values[n / 2 + 2] = 1e20;
            let [lo, hi] = trimmed(&values);
            assert_eq!((lo, hi), (273.0, 303.0), "{n}");
        }
        // Most of the mesh may be masked.
        let mut values = ramp(100);
        values.extend([-9999.0; 300]);
        assert_eq!(trimmed(&values), [273.0, 303.0]);
    }

    #[test]
    fn what_is_no_outlier_stays() {
        let same = |values: Vec<f64>| {
            let [lo, hi] = extremes(values.iter().copied()).unwrap();
            assert_eq!(trimmed(&values), [lo, hi]);
        };
        same(vec![5.0; 30]);
        same([vec![0.0; 50], vec![1.0; 50]].concat());
        same([vec![0.0; 99], vec![1.0]].concat());
        // Air and water.
        same([(0..50).map(|i| 1.2 + 1e-3 * f64::from(i)).collect::<Vec<_>>(), vec![998.0; 50]].concat());
        same(vec![0.0, 1.0, 2.0, 100.0]);
        same((0..40).map(|i| f64::from(i * i)).collect());
        assert_eq!(trimmed(&[]), [0.0, 0.0]);
    }

    #[test]
    fn only_what_is_drawn_counts() {
        let plain = generate::tetrahedra(2);
        let n = plain.points().len();
        let mut points = plain.points().to_vec();
        points.push(glam::DVec3::ZERO);
        let mut values: Vec<f64> = (0..n).map(|i| i as f64).collect();
        values.push(n as f64 + 5.0);
        let s = Array { name: "s".into(), components: 1, values: Values::F64(values) };
        let mesh = Mesh::new(points, plain.cells().clone(), vec![s], vec![]).unwrap();
        let scalars = Scalars { name: "s".into(), association: None, component: None };
        let (found, note) = range(&mesh, &Tetrahedra::new(&mesh).unwrap(), &scalars).unwrap();
        assert_eq!((found, note.as_str()), ([0.0, (n - 1) as f64], "the values of what is drawn"));
    }
}
