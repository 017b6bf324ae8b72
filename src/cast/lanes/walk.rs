//! Eight rays side by side, from plane to plane of the axes.
//!
//! Where a ray crosses a plane is computed in f64 from the plane's number, never added up, and a ray's voxel is where its
//! planes say: so nothing drifts, rays that meet an edge pass it in one step, and what a step is off by is far below what f32
//! can tell. The same steps, eight planes each, lead from block to block.

use crate::cast::volume::{BLOCK, Samples, Volume};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f64x8, u32x8};

/// Rays of a packet: one for each stretch that is integrated at once.
pub(super) use crate::integral::cubic::stretch::LANES;

/// A number for each ray.
pub(super) type Row = [f64; LANES];

/// An index plus this has the index's bits as its lowest.
const INDEX: f64 = (1u64 << 52) as f64;

/// Farther than any plane.
const NEVER: f64 = 1e300;

/// A ray o + t d along the axes, in voxels where these are even, and the part of it that is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub(super) o: [f64; 3],
    pub(super) d: [f64; 3],
    pub(super) limits: [f64; 2],
}

/// What the steps of all rays have in common.
#[derive(Debug)]
pub(super) struct Way<'a> {
    volume: &'a Volume,
    /// Planes of a step.
    unit: usize,
    /// What an index grows by from plane to plane.
    pub(super) strides: [f64; 3],
    /// The same of voxels, if these are asked for.
    pub(super) of_voxels: Option<[f64; 3]>,
}

impl<'a> Way<'a> {
    /// From voxel to voxel, by the indices of values; `of_voxels` asks for those of voxels, too.
    pub(super) fn voxels(volume: &'a Volume, samples: &Samples, of_voxels: bool) -> Self {
        let of = |[x, y, _]: [usize; 3]| [1.0, x as f64, (x * y) as f64];
        let cells = of(volume.cells);
        let strides = if samples.of_cells { cells } else { of(volume.cells.map(|n| n + 1)) };
        Way { volume, unit: 1, strides, of_voxels: of_voxels.then_some(cells) }
    }

    /// From block to block.
    pub(super) fn blocks(volume: &'a Volume, samples: &Samples) -> Self {
        let [x, y, _] = samples.blocks;
        let unit = 1 << BLOCK;
        // A power of two: nothing is lost.
        let strides = [1, x, x * y].map(|s| s as f64 / unit as f64);
        Way { volume, unit, strides, of_voxels: None }
    }

    /// What indices of [`indices`] are added to.
    #[inline(always)]
    pub(super) fn first<S: Simd>(&self, simd: S) -> f64x8<S> {
        f64x8::splat(simd, INDEX)
    }

    /// Where plane `p` of uneven axis `a` is; those beyond the last, which a rounding may ask for, are far away.
    fn place(&self, a: usize, p: f64) -> f64 {
        let axis = &self.volume.axes[a];
        let last = axis.len() - 1;
        let inside = p.clamp(0.0, last as f64);
        axis[inside as usize] + (p - inside) * (axis[last] - axis[0])
    }
}

/// Where eight rays are.
#[derive(Debug, Default)]
pub(super) struct Walker {
    pub(super) o: [Row; 3],
    pub(super) d: [Row; 3],
    /// What planes are measured from to find where they are crossed: o, or out of reach.
    cross: [Row; 3],
    slope: [Row; 3],
    /// The planes that come next, their numbers' steps, and how far behind them a voxel's (block's) lower plane is.
    pub(super) plane: [Row; 3],
    pub(super) step: [Row; 3],
    pub(super) behind: [Row; 3],
    pub(super) t: Row,
    pub(super) end: Row,
    /// What is looked up of uneven axes.
    gathered: [Row; 3],
}

/// What eight rays pass in a step. Rays at their end pass nothing.
pub(super) struct Stretch<S: Simd> {
    pub(super) from: f64x8<S>,
    pub(super) to: f64x8<S>,
    pub(super) index: u32x8<S>,
    pub(super) voxel: u32x8<S>,
    /// Where in the voxel it begins, along each axis, from 0 to 1, but for a rounding.
    pub(super) start: [f32x8<S>; 3],
    /// How many voxels wide it is, along each axis.
    pub(super) rise: [f32x8<S>; 3],
    /// In the units of t.
    pub(super) length: f32x8<S>,
}

/// Indices of which each is the lowest bits of a number.
#[inline(always)]
pub(super) fn indices<S: Simd>(simd: S, of: f64x8<S>) -> u32x8<S> {
    let numbers: Row = of.into();
    u32x8::load_array(simd, numbers.map(|n| n.to_bits() as u32))
}

#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, row: &Row) -> f64x8<S> {
    f64x8::load_array_ref(simd, row)
}

/// As f32.
#[inline(always)]
pub(super) fn narrow<S: Simd>(simd: S, v: f64x8<S>) -> f32x8<S> {
    let (low, high) = v.split();
    simd.narrow_f64x4(low, high)
}

impl Walker {
    /// Has lane `l` follow a ray; it stays where it is until it starts.
    pub(super) fn set(&mut self, l: usize, ray: &Ray) {
        for a in 0..3 {
            let (o, d) = (ray.o[a], ray.d[a]);
            (self.o[a][l], self.d[a][l]) = (o, d);
            (self.cross[a][l], self.slope[a][l]) = if d == 0.0 { (-NEVER, 1.0) } else { (o, 1.0 / d) };
        }
        (self.t[l], self.end[l]) = (ray.limits[0], ray.limits[0]);
    }

    /// Nothing in lane `l`.
    pub(super) fn clear(&mut self, l: usize) {
        self.set(l, &Ray { o: [0.0; 3], d: [0.0; 3], limits: [0.0; 2] });
        for a in 0..3 {
            (self.plane[a][l], self.step[a][l], self.behind[a][l]) = (0.0, 0.0, 0.0);
        }
    }

    /// Has lane `l` go from t = `from` to `to`.
    #[inline(never)]
    pub(super) fn start(&mut self, way: &Way, l: usize, [from, to]: [f64; 2]) {
        let unit = way.unit as f64;
        for a in 0..3 {
            let (x, last) = (self.o[a][l] + self.d[a][l] * from, way.volume.cells[a] - 1);
            let voxel = if way.volume.even {
                (x.max(0.0) as usize).min(last)
            } else {
                (way.volume.axes[a].partition_point(|c| *c <= x).max(1) - 1).min(last)
            };
            let low = (voxel / way.unit * way.unit) as f64;
            let d = self.d[a][l];
            // A ray along the planes stays between two.
            self.behind[a][l] = if d < 0.0 { 0.0 } else { unit };
            self.plane[a][l] = low + self.behind[a][l];
            self.step[a][l] = if d == 0.0 { 0.0 } else { unit.copysign(d) };
        }
        (self.t[l], self.end[l]) = (from, to);
    }

    /// Passes a voxel, or a block, with each ray.
    #[inline(always)]
    pub(super) fn advance<S: Simd>(&mut self, simd: S, way: &Way) -> Stretch<S> {
        let zero = f64x8::splat(simd, 0.0);
        let (from, end) = (load(simd, &self.t), load(simd, &self.end));
        let plane = [load(simd, &self.plane[0]), load(simd, &self.plane[1]), load(simd, &self.plane[2])];
        let mut low = [zero; 3];
        for a in 0..3 {
            low[a] = plane[a] - load(simd, &self.behind[a]);
        }
        let mut number = f64x8::splat(simd, INDEX);
        for a in 0..3 {
            number = low[a].mul_add(f64x8::splat(simd, way.strides[a]), number);
        }
        let mut voxel = number;
        if let Some(strides) = way.of_voxels {
            voxel = f64x8::splat(simd, INDEX);
            for a in 0..3 {
                voxel = low[a].mul_add(f64x8::splat(simd, strides[a]), voxel);
            }
        }
        let (mut place, mut inverse) = (plane, [f64x8::splat(simd, 1.0); 3]);
        if !way.volume.even {
            for a in 0..3 {
                let numbers: Row = low[a].into();
                for l in 0..LANES {
                    let i = (numbers[l].max(0.0) as usize).min(way.volume.cells[a] - 1);
                    let next = self.plane[a][l];
                    (self.gathered[0][l], self.gathered[1][l], self.gathered[2][l]) =
                        (way.place(a, next), way.place(a, numbers[l]), way.volume.inverse[a][i]);
                }
                place[a] = load(simd, &self.gathered[0]);
                low[a] = load(simd, &self.gathered[1]);
                inverse[a] = load(simd, &self.gathered[2]);
            }
        }
        let mut next = [zero; 3];
        for a in 0..3 {
            next[a] = (place[a] - load(simd, &self.cross[a])) * load(simd, &self.slope[a]);
        }
        let to = next[0].min(next[1]).min(next[2].min(end)).max(from);
        for a in 0..3 {
            let step = next[a].simd_le(to).select(load(simd, &self.step[a]), zero);
            (plane[a] + step).store_array(&mut self.plane[a]);
        }
        to.store_array(&mut self.t);
        let length = narrow(simd, to - from);
        let none = length * 0.0;
        let (mut start, mut rise) = ([none; 3], [none; 3]);
        for a in 0..3 {
            let d = load(simd, &self.d[a]);
            let x = d.mul_add(from, load(simd, &self.o[a])) - low[a];
            if way.volume.even {
                start[a] = narrow(simd, x);
                rise[a] = narrow(simd, d) * length;
            } else {
                start[a] = narrow(simd, x * inverse[a]);
                rise[a] = narrow(simd, d * inverse[a]) * length;
            }
        }
        Stretch { from, to, index: indices(simd, number), voxel: indices(simd, voxel), start, rise, length }
    }
}

/// Parts of a ray along which something is seen, in order.
#[derive(Debug, Default)]
pub(super) struct Runs {
    all: Vec<[f64; 2]>,
    next: usize,
}

impl Runs {
    /// None any more.
    pub(super) fn clear(&mut self) {
        self.all.clear();
        self.next = 0;
    }

    /// The part from one t to another, which joins the last if that ends there.
    #[inline(always)]
    pub(super) fn add(&mut self, [from, to]: [f64; 2]) {
        match self.all.last_mut() {
            Some(last) if last[1] == from => last[1] = to,
            _ => self.all.push([from, to]),
        }
    }

    /// The one that comes next.
    #[inline(always)]
    pub(super) fn take(&mut self) -> Option<[f64; 2]> {
        self.next += 1;
        self.all.get(self.next - 1).copied()
    }
}

/// Finds the parts of eight rays that are in blocks which are `seen`.
#[inline(always)]
pub(super) fn find_runs<S: Simd>(
    simd: S,
    walker: &mut Walker,
    way: &Way,
    rays: &[Option<Ray>; LANES],
    seen: &[bool],
    runs: &mut [Runs; LANES],
) {
    for (l, ray) in rays.iter().enumerate() {
        walker.clear(l);
        if let Some(ray) = ray {
            walker.set(l, ray);
            walker.start(way, l, ray.limits);
        }
    }
    loop {
        let stretch = walker.advance(simd, way);
        let (from, to): (Row, Row) = (stretch.from.into(), stretch.to.into());
        let blocks: [u32; LANES] = stretch.index.into();
        for l in 0..LANES {
            if to[l] > from[l] && seen.get(blocks[l] as usize).is_some_and(|seen| *seen) {
                runs[l].add([from[l], to[l]]);
            }
        }
        if stretch.to.simd_lt(load(simd, &walker.end)).to_bitmask() == 0 {
            return;
        }
    }
}
