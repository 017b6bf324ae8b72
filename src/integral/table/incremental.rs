//! Slices from slices.
//!
//! A segment of twice the length is two halves that meet at the middle value: I(s_f, s_b, 2l) = I(s_f, s_m, l) ⊕ I(s_m,
//! s_b, l). And one that is Δl longer is a slab before it: I(s_f, s_b, l + Δl) = I(s_f, s′, Δl) ⊕ I(s′, s_b, l) with s′
//! = s_f + (s_b − s_f) Δl/(l + Δl). Where s_m or s′ lies between two values, the slices are interpolated: that is what
//! these constructions lose.

use super::closed;
use super::grid::Grid;
use super::volume::{Kind, Table, length};
use super::{Storage, is_scalar, mix};
use crate::integral::Exact;
use rayon::prelude::*;

/// What is in front of `behind`, both premultiplied.
#[inline(always)]
fn over(front: [f32; 4], behind: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|k| front[k] + (1.0 - front[3]) * behind[k])
}

impl Table {
    /// A table of premultiplied colour and opacity, whose first slice with a length is in closed form and whose others
    /// are each made of that before, in f32. `None` as [`Table::new`], for [`Kind::LogNormalised`], and unless there
    /// are as many values behind as in front.
    pub fn incremental(exact: &Exact<f64>, kind: Kind, size: [u32; 3], longest: f64) -> Option<Self> {
        let n = size[0] as usize;
        if !is_scalar(exact) || n < 3 || size[1] != size[0] || size[2] < 3 || kind == Kind::LogNormalised {
            return None;
        }
        let mut texels = Storage::zeroed(n * n * size[2] as usize);
        let (done, rest) = texels.split_at_mut(2 * n * n);
        done[n * n..].copy_from_slice(&closed::slice(&Grid::new(exact, size[0]), length(kind, size[2], longest, 1)));
        let first = &done[n * n..];
        match kind {
            Kind::Uniform => {
                // A row, all of one value behind, is made of that row of the slice before: rows need not wait for each
                // other.
                let mut by_row: Vec<Vec<&mut [[f32; 4]]>> = (0..n).map(|_| vec![]).collect();
                for slice in rest.chunks_exact_mut(n * n) {
                    slice.chunks_exact_mut(n).zip(&mut by_row).for_each(|(row, rows)| rows.push(row));
                }
                by_row.into_par_iter().enumerate().for_each(|(j, mut rows)| {
                    for k in 0..rows.len() {
                        let (before, after) = rows.split_at_mut(k);
                        let before = before.last().map_or(&first[j * n..(j + 1) * n], |r| &**r);
                        longer(first, before, after[0], j, k as f32 + 1.0);
                    }
                });
            }
            _ => {
                let mut before = first;
                for slice in rest.chunks_exact_mut(n * n) {
                    slice.par_chunks_exact_mut(n).enumerate().for_each(|(j, row)| doubled(before, row, j));
                    before = slice;
                }
            }
        }
        Some(Table { kind, size, longest, direct: exact.direct, texels })
    }
}

/// The row of value `j` behind, of slice k + 1, from that of slice k, `before`.
fn longer(first: &[[f32; 4]], before: &[[f32; 4]], row: &mut [[f32; 4]], j: usize, k: f32) {
    let n = row.len();
    for (i, texel) in row.iter_mut().enumerate() {
        let middle = i as f32 + (j as f32 - i as f32) / (k + 1.0);
        let low = (middle as usize).min(n - 2);
        let share = middle - low as f32;
        let slab = mix(first[low * n + i], first[(low + 1) * n + i], share);
        *texel = over(slab, mix(before[low], before[low + 1], share));
    }
}

/// The row of value `j` behind, of twice the length of the slice `before`.
fn doubled(before: &[[f32; 4]], row: &mut [[f32; 4]], j: usize) {
    let n = row.len();
    for (i, texel) in row.iter_mut().enumerate() {
        let (low, high) = ((i + j) / 2, (i + j).div_ceil(2));
        let front = mix(before[low * n + i], before[high * n + i], 0.5);
        *texel = over(front, mix(before[j * n + low], before[j * n + high], 0.5));
    }
}
