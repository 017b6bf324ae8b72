//! Values that are missing (NaN, or infinite), drawn in a colour of their own.
//!
//! They become a value beyond all others, where the transfer function has a step to that colour. A tetrahedron with such
//! a point is drawn so as a whole, as without it would be left out as a whole: it gets points of its own.

use super::Scalars;
use crate::error::{Error, Result};
use crate::field::{Association, Component, Field, Kind};
use crate::mesh::cells::Tetrahedra;
use crate::mesh::{Cells, Mesh};
use crate::transfer::TransferFunction;
use crate::view::Blend;
use std::collections::HashMap;

/// What is drawn in the place of a mesh, its field and its transfer function.
#[derive(Debug)]
pub struct Shown {
    /// The mesh of tetrahedra, and they; none if those that there were are drawn.
    pub mesh: Option<(Mesh, Tetrahedra)>,
    /// The field, in which no value is missing.
    pub field: Field,
    /// The transfer function.
    pub transfer: TransferFunction,
}

/// Draws where values of `scalars` are missing in `color`, as opaque as `opacity` says, or as the most opaque value.
/// None if no value is missing.
///
/// # Errors
/// [`Error::Field`] if there are no such scalars, or they are not one value each; [`Error::Transfer`] for a colour or an
/// opacity that cannot be.
pub fn shown(
    mesh: &Mesh,
    tetrahedra: &Tetrahedra,
    scalars: &Scalars,
    transfer: &TransferFunction,
    blend: Blend,
    color: [f64; 3],
    opacity: Option<f64>,
) -> Result<Option<Shown>> {
    let (association, mut numbers) = numbers(mesh, scalars)?;
    if numbers.iter().all(|v| v.is_finite()) {
        return Ok(None);
    }
    let (value, transfer) = beyond(&numbers, transfer, blend, color, opacity)?;
    let field = |numbers: &[f64]| Field::from_slice(&scalars.name, numbers, 1, association, Component::Index(0));
    if association == Association::Cell {
        numbers.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = value);
        return Ok(Some(Shown { mesh: None, field: field(&numbers)?, transfer }));
    }
    let mut points = tetrahedra.points(mesh.points()).into_owned();
    for i in 0..tetrahedra.added.len() {
        let mean = tetrahedra.added.of(i).map(|(source, weight)| weight * numbers[source as usize]).sum();
        numbers.push(mean);
    }
    let (mut corners, mut copies) = (tetrahedra.corners.clone(), HashMap::new());
    for tetrahedron in &mut corners {
        if tetrahedron.iter().all(|&p| numbers[p as usize].is_finite()) {
            continue;
        }
        for p in tetrahedron {
            *p = *copies.entry(*p).or_insert_with(|| {
                points.push(points[*p as usize]);
                (points.len() - 1) as u32
            });
        }
    }
    numbers.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = value);
    numbers.resize(points.len(), value);
    let cells = Cells {
        types: vec![10; corners.len()],
        offsets: (0..=corners.len() as u64).map(|i| 4 * i).collect(),
        connectivity: corners.into_flattened(),
    };
    let mesh = Mesh::new(points, cells, vec![], vec![])?;
    let tetrahedra = Tetrahedra::new(&mesh)?;
    Ok(Some(Shown { mesh: Some((mesh, tetrahedra)), field: field(&numbers)?, transfer }))
}

/// The same of a field on a grid: the value that is to stand for those that are missing ([`Field::with_missing`]), and the
/// transfer function.
///
/// # Errors
/// As [`shown`].
pub fn shown_of_grid(
    field: &Field,
    transfer: &TransferFunction,
    blend: Blend,
    color: [f64; 3],
    opacity: Option<f64>,
) -> Result<Option<(f64, TransferFunction)>> {
    if field.kind() != Kind::Scalar {
        return Err(Error::Field("missing values have a colour where one value drives it".into()));
    }
    if (0..field.len()).all(|i| field.value(i).is_finite()) {
        return Ok(None);
    }
    beyond(&field.range(0), transfer, blend, color, opacity).map(Some)
}

/// The values of `scalars`, as the array has them.
fn numbers(mesh: &Mesh, scalars: &Scalars) -> Result<(Association, Vec<f64>)> {
    let found = [(Association::Point, mesh.point_arrays()), (Association::Cell, mesh.cell_arrays())]
        .into_iter()
        .filter(|(a, _)| scalars.association.is_none_or(|of| of == *a))
        .find_map(|(a, arrays)| arrays.iter().find(|x| x.name == scalars.name).map(|x| (a, x)));
    let Some((association, array)) = found else {
        return Err(Error::Field(format!("no array is called \"{}\"", scalars.name)));
    };
    let n = array.components;
    let component = match scalars.component {
        Some(Component::Index(k)) if k < n => Some(k),
        None | Some(Component::Magnitude) if n > 1 => None,
        None | Some(Component::Magnitude) => Some(0),
        Some(_) => {
            let what = format!("array \"{}\": missing values have a colour where one value drives it", scalars.name);
            return Err(Error::Field(what));
        }
    };
    let get = |i: usize| array.values.get(i);
    let number = |t: usize| match component {
        Some(k) => get(t * n + k),
        None => (0..n).fold(0.0_f64, |length, k| length.hypot(get(t * n + k))),
    };
    Ok((association, (0..array.tuples()).map(number).collect()))
}

/// A value beyond all of `numbers` and all knots, on the side where fewer lie beyond the knots, and the function with a
/// step before it. A maximum must not be it, so there it is on the lower side.
fn beyond(
    numbers: &[f64],
    transfer: &TransferFunction,
    blend: Blend,
    color: [f64; 3],
    opacity: Option<f64>,
) -> Result<(f64, TransferFunction)> {
    let (mut colors, mut opacities) = (transfer.color().to_vec(), transfer.opacity().to_vec());
    let knots = || colors.iter().map(|k| k.0).chain(opacities.iter().map(|k| k.0));
    let span = |all: &mut dyn Iterator<Item = f64>| {
        all.filter(|v| v.is_finite()).fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)])
    };
    let [first, last] = span(&mut knots());
    let [lo, hi] = span(&mut numbers.iter().copied().chain(knots()));
    let upward = blend != Blend::Maximum && hi - last <= first - lo;
    let end = if upward { hi } else { lo };
    // As wide as the function, but so that numbers tell the two apart.
    let gap = (0.25 * (last - first)).max(1e-3 * end.abs()).max(if end == 0.0 { 0.25 } else { 0.0 });
    let gap = if upward { gap } else { -gap };
    let (step, value) = (end + gap, end + 2.0 * gap);
    let opacity = opacity.unwrap_or_else(|| opacities.iter().fold(0.0, |most, k| k.1.max(most)));
    add(&mut colors, [step, value + gap], color, upward, (!transfer.clamp()).then_some([0.0; 3]));
    add(&mut opacities, [step, value + gap], opacity, upward, (!transfer.clamp()).then_some(0.0));
    Ok((value, transfer.with_knots(colors, opacities)?))
}

/// Has knots end in `value` from `step` to `end`, beyond them `upward` or downward; between is what was there, or `none`.
fn add<T: Copy>(knots: &mut Vec<(f64, T)>, [step, end]: [f64; 2], value: T, upward: bool, none: Option<T>) {
    let mut outer: Vec<(f64, T)> = Vec::new();
    let edge = if upward { knots[knots.len() - 1] } else { knots[0] };
    if let Some(none) = none {
        // A hair beyond, so that the last knot's own value keeps what it has.
        let hair = edge.0 + 1e-5 * (step - edge.0);
        outer.extend([(hair, edge.1), (hair, none)]);
    }
    outer.extend([(step, none.unwrap_or(edge.1)), (step, value), (end, value)]);
    if upward {
        knots.extend(outer);
    } else {
        outer.reverse();
        knots.splice(0..0, outer);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Array, Values, generate};

    fn function() -> TransferFunction {
        TransferFunction::new(vec![(0.0, [0.0; 3]), (1.0, [1.0; 3])], vec![(0.2, 0.1), (0.9, 0.5)], 1.0).unwrap()
    }

    #[test]
    fn a_value_beyond_all_others() {
        let red = [1.0, 0.0, 0.0];
        for (numbers, blend, upward) in [
            (vec![0.0, 1.0, f64::NAN], Blend::Composite, true),
            (vec![0.0, 1e20, f64::NAN], Blend::Composite, false),
            (vec![-9999.0, 1.0, f64::INFINITY], Blend::Composite, true),
            (vec![0.0, 1.0, f64::NAN], Blend::Maximum, false),
        ] {
            for clamp in [true, false] {
                let old = function().with_clamp(clamp);
                let (value, new) = beyond(&numbers, &old, blend, red, Some(0.7)).unwrap();
                assert!(if upward { value > 1.0 } else { value < 0.0 });
                assert_eq!((new.color_at(value), new.opacity_at(value)), (red, 0.7));
                for &s in numbers.iter().filter(|v| v.is_finite()).chain(&[0.3, 0.95, -0.1, 1.1]) {
                    assert!((value - s).abs() > 0.1);
                    assert_eq!(
                        (new.color_at(s), new.opacity_at(s)),
                        (old.color_at(s), old.opacity_at(s)),
                        "{s} {clamp}"
                    );
                }
                let most = beyond(&numbers, &old, blend, red, None).unwrap();
                assert_eq!(most.1.opacity_at(most.0), 0.5);
            }
        }
    }

    /// Tetrahedra with a missing value are drawn as a whole, and no other is changed.
    #[test]
    fn tetrahedra_are_missing_as_a_whole() {
        let mut mesh = generate::demo(2);
        let n = mesh.points().len();
        let values: Vec<f32> = (0..n).map(|i| if i % 7 == 3 { f32::NAN } else { i as f32 }).collect();
        let array = Array { name: "v".into(), components: 1, values: Values::F32(values.clone()) };
        mesh.add_point_array(array).unwrap();
        let tetrahedra = Tetrahedra::new(&mesh).unwrap();
        let scalars = Scalars { name: "v".into(), association: None, component: None };
        let blend = Blend::Composite;
        let shown = shown(&mesh, &tetrahedra, &scalars, &function(), blend, [1.0; 3], None).unwrap().unwrap();
        let (own, split) = shown.mesh.unwrap();
        assert_eq!(split.corners.len(), tetrahedra.corners.len());
        let value = |p: u32| shown.field.value(p as usize);
        let mut missing = 0;
        for (new, old) in split.corners.iter().zip(&tetrahedra.corners) {
            let nan = old.iter().any(|&p| values[p as usize].is_nan());
            missing += usize::from(nan);
            for k in 0..4 {
                assert_eq!(own.points()[new[k] as usize], mesh.points()[old[k] as usize]);
                let beyond = value(new[k]) < -0.1 || value(new[k]) > n as f64;
                assert!(beyond == nan && (nan || (value(new[k]) - f64::from(old[k])).abs() < 1e-3));
            }
        }
        assert!(missing > 0 && missing < split.corners.len());
        let whole = Array { name: "w".into(), components: 1, values: Values::F32(vec![1.0; n]) };
        mesh.add_point_array(whole).unwrap();
        let scalars = Scalars { name: "w".into(), ..scalars };
        assert!(super::shown(&mesh, &tetrahedra, &scalars, &function(), blend, [1.0; 3], None).unwrap().is_none());
    }
}
