//! Vectors of doubles: what [set-up](super::setup) reckons eight cells with.

use super::setup::EIGHT;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f64x8};
use glam::DVec3;

/// x, y, z.
pub(super) type Triple<S> = [f64x8<S>; 3];

/// The cross product. (Closures that are called more than once need not become part of their caller, where alone the vector
/// instructions are known.)
#[inline(always)]
pub(super) fn cross<S: Simd>(a: Triple<S>, b: Triple<S>) -> Triple<S> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `rows` times the vectors.
#[inline(always)]
pub(super) fn turn<S: Simd>(simd: S, rows: &[DVec3; 3], d: &[[f64; EIGHT]; 3]) -> Triple<S> {
    let (x, y, z) =
        (f64x8::load_array_ref(simd, &d[0]), f64x8::load_array_ref(simd, &d[1]), f64x8::load_array_ref(simd, &d[2]));
    let [a, b, c] = rows;
    [
        x.mul_add(f64x8::splat(simd, a.x), y.mul_add(f64x8::splat(simd, a.y), z * a.z)),
        x.mul_add(f64x8::splat(simd, b.x), y.mul_add(f64x8::splat(simd, b.y), z * b.z)),
        x.mul_add(f64x8::splat(simd, c.x), y.mul_add(f64x8::splat(simd, c.y), z * c.z)),
    ]
}

/// Never 0, of the sign of `v`.
#[inline(always)]
pub(super) fn guard<S: Simd>(v: f64x8<S>, scale: f64x8<S>) -> f64x8<S> {
    v.abs().max(scale * 1e-12 + 1e-280).copysign(v)
}

/// What two products may be off by.
#[inline(always)]
pub(super) fn terms<S: Simd>(p: Triple<S>, r: Triple<S>) -> f64x8<S> {
    (p[0] * r[1]).abs() + (p[1] * r[0]).abs()
}

/// Single floats as doubles.
#[inline(always)]
pub(super) fn wide<S: Simd>(simd: S, v: [f32; EIGHT]) -> f64x8<S> {
    let mut all = [0.0; EIGHT];
    for (to, v) in all.iter_mut().zip(v) {
        *to = f64::from(v);
    }
    f64x8::load_array(simd, all)
}

/// As single floats.
#[inline(always)]
pub(super) fn single<S: Simd>(simd: S, v: f64x8<S>) -> f32x8<S> {
    let mut all = [0.0; EIGHT];
    for (to, v) in all.iter_mut().zip(v.to_array()) {
        *to = v as f32;
    }
    f32x8::load_array(simd, all)
}

/// Four numbers of each cell, cell by cell.
#[inline(always)]
pub(super) fn by_cell<S: Simd>(simd: S, [a, b, c, d]: [f32x8<S>; 4]) -> [[f32; 4]; EIGHT] {
    let (a, b, c, d) = (a.split(), b.split(), c.split(), d.split());
    let mut all = [[0.0; 16]; 2];
    simd.store_four_interleaved_f32x4([a.0, b.0, c.0, d.0], &mut all[0]);
    simd.store_four_interleaved_f32x4([a.1, b.1, c.1, d.1], &mut all[1]);
    let mut rows = [[0.0; 4]; EIGHT];
    rows.as_flattened_mut().copy_from_slice(all.as_flattened());
    rows
}

/// As [`by_cell`], of doubles.
#[inline(always)]
pub(super) fn singles<S: Simd>(simd: S, v: [f64x8<S>; 4]) -> [[f32; 4]; EIGHT] {
    by_cell(simd, [single(simd, v[0]), single(simd, v[1]), single(simd, v[2]), single(simd, v[3])])
}
