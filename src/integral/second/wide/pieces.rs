//! Where segments side by side turn, and those of them that are cut there: their pieces lie side by side again, so that none
//! waits until another has passed its turns.

#![allow(clippy::needless_range_loop, reason = "closures over arrays of vectors are not inlined")]

use super::nodes::{splat, turn_little};
use super::panel::{EVERYWHERE, HALVES, MOST_PANELS, NEAR, SAME, towards};
use super::room::{Numbers, load, none, window, window_mut};
use super::{Cell, Form, Room, Row, Segments, Source, Wide};
use crate::integral::Knots;
use crate::integral::floats::{Floats, LANES};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16};

/// The most pieces of one segment that are put together.
const MOST_ROUNDS: usize = 16;
/// Cells on more lines of a function have no pieces left out.
const FEW_LINES: usize = 4;
/// So many pieces are taken at a time.
const ENOUGH: usize = 256;

/// Pieces of segments, and what they belong to.
#[derive(Debug)]
pub(super) struct Pieces {
    /// As [`Room::rows`], but for [`Row::FIRST`]: there is how many panels bends ask for.
    rows: Numbers,
    count: usize,
    cuts: Vec<Cut>,
    /// Of each round of each sixteen segments, its first piece, and a bit for each segment that has one.
    rounds: Vec<(usize, u64)>,
    /// Of each sixteen pieces, those that must be taken one by one.
    left: Vec<u64>,
}

/// Sixteen segments in pieces: the first of them, those that are left, and the rounds.
#[derive(Debug, Clone, Copy)]
struct Cut {
    first: usize,
    left: u64,
    rounds: [usize; 2],
}

impl Default for Pieces {
    fn default() -> Self {
        Pieces { rows: none(), count: 0, cuts: vec![], rounds: vec![], left: vec![] }
    }
}

impl Pieces {
    pub(super) fn is_full(&self) -> bool {
        self.count > ENOUGH
    }
}

/// `place`, if it is beyond `u` and before `next`; else `next`.
#[inline(always)]
fn nearer<S: Simd>(next: Floats<S>, place: Floats<S>, u: Floats<S>) -> Floats<S> {
    place.simd_gt(u + SAME).select(next.min(place), next)
}

/// The sooner of `next` and where beyond `u` a whole number from `least` to `most` is passed.
#[inline(always)]
fn next_whole<S: Simd>(
    simd: S,
    next: Floats<S>,
    at: Floats<S>,
    rise: Floats<S>,
    [least, most]: [f32; 2],
    u: Floats<S>,
) -> Floats<S> {
    let (zero, least, most) = (Floats::splat(simd, 0.0), Floats::splat(simd, least), Floats::splat(simd, most));
    let now = rise.mul_add(u, at);
    let up = rise.simd_gt(zero);
    let whole = up.select((now + NEAR).floor() + 1.0, (now - NEAR).ceil() - 1.0);
    let whole = up.select(whole.max(least), whole.min(most));
    let over = Floats::splat(simd, 1.0) / rise;
    let place = (whole - at) * over;
    // What is as good as here is followed by the next.
    let place = place.simd_gt(u + SAME).select(place, place + over.abs());
    let some = whole.simd_ge(least) & whole.simd_le(most) & !rise.simd_eq(zero);
    nearer(next, some.select(place, Floats::splat(simd, f32::INFINITY)), u)
}

/// The sooner of `next` and where beyond `u` the start of one of the lines after the first is passed.
#[inline(always)]
fn next_knot<S: Simd>(
    simd: S,
    mut next: Floats<S>,
    knots: &Knots<f32>,
    lines: [u16; 2],
    at: Floats<S>,
    rise: Floats<S>,
    u: Floats<S>,
) -> Floats<S> {
    let over = Floats::splat(simd, 1.0) / rise;
    for k in usize::from(lines[0]) + 1..=usize::from(lines[1]) {
        next = nearer(next, (Floats::splat(simd, knots.s[k]) - at) * over, u);
    }
    next
}

impl Wide {
    /// Finds where along segments the boxes of widgets are that end in the cell.
    #[inline(always)]
    pub(super) fn clip<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        room: &mut Room,
    ) {
        let Source::Widgets(widgets) = &self.source else { return };
        let zero = Floats::splat(simd, 0.0);
        for k in 0..cell.count() {
            if !cell.clips(k) {
                continue;
            }
            let domain = &widgets[usize::from(cell.active[k])].domain;
            let (mut from, mut to) = (Floats::splat(simd, f32::NEG_INFINITY), Floats::splat(simd, f32::INFINITY));
            for v in 0..2 {
                let (at, rise) = (segments.at[v], segments.rise[v]);
                let [low, high] = [Floats::splat(simd, domain[v][0]), Floats::splat(simd, domain[v][1])];
                let over = Floats::splat(simd, 1.0) / rise;
                let (a, b) = ((low - at) * over, (high - at) * over);
                let still = rise.simd_eq(zero);
                let outside = still & (at.simd_lt(low) | at.simd_gt(high));
                from = still.select(from, from.max(a.min(b)));
                to = still.select(to, to.min(a.max(b)));
                to = outside.select(Floats::splat(simd, f32::NEG_INFINITY), to);
            }
            from.store_array(&mut room.clips[k][0]);
            to.store_array(&mut room.clips[k][1]);
        }
    }

    /// Where beyond `u` segments next turn or jump, or end.
    #[inline(always)]
    pub(super) fn next<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        room: &Room,
        u: Floats<S>,
    ) -> Floats<S> {
        let mut next = Floats::splat(simd, 1.0);
        let Segments { at, rise, .. } = segments;
        match &self.source {
            Source::Widgets(widgets) => {
                for k in 0..cell.count() {
                    if cell.clips(k) {
                        next = nearer(next, load(simd, &room.clips[k][0]), u);
                        next = nearer(next, load(simd, &room.clips[k][1]), u);
                    }
                    let Form::Wave { axis, start, profile } = &widgets[usize::from(cell.active[k])].form else {
                        continue;
                    };
                    if cell.turning >> k & 1 == 0 {
                        continue;
                    }
                    let [x, y] = [Floats::splat(simd, axis[0]), Floats::splat(simd, axis[1])];
                    let p = at[0].mul_add(x, at[1].mul_add(y, Floats::splat(simd, *start)));
                    let d = rise[0].mul_add(x, rise[1] * y);
                    if profile.turns() == [0.0, 0.5] {
                        next = next_whole(simd, next, p * 2.0, d * 2.0, EVERYWHERE, u);
                        continue;
                    }
                    for &turn in profile.turns() {
                        next = next_whole(simd, next, p - turn as f32, d, EVERYWHERE, u);
                    }
                }
            }
            Source::Scalar(knots) => next = next_knot(simd, next, knots, cell.lines, at[0], rise[0], u),
            Source::Texels(texels) => {
                for k in 0..2 {
                    let scale = texels.scale[k];
                    let place = at[k].mul_add(Floats::splat(simd, scale), Floats::splat(simd, texels.offset[k]));
                    next = next_whole(simd, next, place, rise[k] * scale, [0.0, texels.size[k] as f32 - 1.0], u);
                }
            }
        }
        if let Some(factor) = &self.factor {
            next = next_knot(simd, next, factor, cell.factors, at[1], rise[1], u);
        }
        if N == 5 {
            let zero = Floats::splat(simd, 0.0);
            let lights = self.light.as_ref().map_or(&[][..], |l| &l.lights);
            if self.on_ray {
                let [front, rise] = towards(segments, segments.along);
                next = nearer(next, (zero - front) / rise, u);
            }
            for (_, to) in lights {
                let Some(to) = to else { continue };
                let [front, rise] = towards(segments, splat(simd, *to));
                next = nearer(next, (zero - front) / rise, u);
            }
        }
        next
    }

    /// Whether a segment passes a place where a face of the light turns away.
    #[inline(always)]
    pub(super) fn light_turns<S: Simd, const N: usize>(&self, simd: S, segments: &Segments<S, N>) -> bool {
        if N < 5 {
            return false;
        }
        let (zero, mut turns) = (Floats::splat(simd, 0.0), 0);
        if self.on_ray {
            let [front, rise] = towards(segments, segments.along);
            turns |= (front * (front + rise)).simd_lt(zero).to_bitmask();
        }
        for (_, to) in self.light.as_ref().map_or(&[][..], |l| &l.lights) {
            let Some(to) = to else { continue };
            let [front, rise] = towards(segments, splat(simd, *to));
            turns |= (front * (front + rise)).simd_lt(zero).to_bitmask();
        }
        turns & segments.there.to_bitmask() != 0
    }

    /// Cuts sixteen segments, those from `first` on, where they turn, in pieces that are a panel each. Says whether that was done:
    /// very many pieces are none.
    #[inline(always)]
    pub(super) fn cut<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        (breaks, bend): (bool, Floats<S>),
        first: usize,
        room: &mut Room,
    ) -> bool {
        let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
        if breaks && cell.clipped != 0 {
            self.clip(simd, cell, segments, room);
        }
        let mut left = (segments.there & bend.simd_gt(Floats::splat(simd, MOST_PANELS))).to_bitmask();
        let mut open = segments.there & !mask32x16::from_bitmask(simd, left);
        let most = self.most_bend();
        let longest = one / (bend * (1.0 / most)).max(one);
        let cosine = if most > 1.0 { self.cosines[1] } else { self.cosines[0] };
        let (mut u, mut end) = (zero, one);
        let (start, count) = (room.pieces.rounds.len(), room.pieces.count);
        for _ in 0..MOST_ROUNDS {
            if breaks {
                end = self.next(simd, cell, segments, room, u);
            }
            let rest = end - u;
            let ends = rest.simd_lt(longest * (1.0 + NEAR));
            // No sliver is left to the last.
            let mut h = ends.select(rest, rest.simd_lt(longest * 2.0).select(rest * 0.5, longest));
            if N == 5 {
                for half in 0..=HALVES {
                    let far = open & !turn_little(simd, segments, u, h, cosine);
                    if far.to_bitmask() == 0 {
                        break;
                    }
                    if half == HALVES {
                        left |= far.to_bitmask();
                        open &= !far;
                    }
                    h = far.select(h * 0.5, h);
                }
            }
            let all = h.simd_ge(rest);
            let middle = h.mul_add(Floats::splat(simd, 0.5), u);
            let shown = open & !self.is_empty(simd, cell, segments, middle);
            room.pieces.put(simd, segments, [u, h, bend * h], shown);
            u = all.select(end, u + h);
            open &= u.simd_lt(Floats::splat(simd, 1.0 - SAME));
            if open.to_bitmask() == 0 {
                let rounds = [start, room.pieces.rounds.len()];
                room.pieces.cuts.push(Cut { first, left, rounds });
                return true;
            }
        }
        room.pieces.rounds.truncate(start);
        room.pieces.count = count;
        false
    }

    /// Whether pieces, in whose middle are places, emit and absorb nothing, as far as that is told without much ado.
    #[inline(always)]
    fn is_empty<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        middle: Floats<S>,
    ) -> mask32x16<S> {
        let mut empty = mask32x16::from_bitmask(simd, 0);
        let Source::Scalar(knots) = &self.source else { return empty };
        let [first, last] = cell.lines.map(usize::from);
        if self.shining.is_some() || last - first > FEW_LINES {
            return empty;
        }
        let s = segments.rise[0].mul_add(middle, segments.at[0]);
        for k in first..=last {
            if knots.value[k][0] == 0.0 && knots.slope[k][0] == 0.0 {
                let mut on = if k > first {
                    s.simd_ge(Floats::splat(simd, knots.s[k]))
                } else {
                    mask32x16::from_bitmask(simd, u64::MAX)
                };
                if k < last {
                    on &= s.simd_lt(Floats::splat(simd, knots.s[k + 1]));
                }
                empty |= on;
            }
        }
        empty
    }

    /// Finds what all pieces emit and absorb, and adds that up for their segments. Calls `left` for those that must be taken one by one.
    /// Returns the number of panels.
    #[inline(always)]
    pub(super) fn join<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        room: &mut Room,
        left: &mut dyn FnMut(usize),
    ) -> u64 {
        let mut panels = 0;
        let count = room.pieces.count;
        for first in (0..count).step_by(LANES) {
            let there = u64::MAX >> (64 - (count - first).min(LANES));
            let segments = Segments::<S, N>::new(simd, &room.pieces.rows, first, there);
            let bend = load(simd, window(&room.pieces.rows[Row::<N>::FIRST], first));
            let taken = self.step(simd, cell, &segments, None, self.takes_four(simd, &segments, bend), room);
            panels += u64::from(taken.panels);
            for k in 0..3 {
                taken.color[k].store_array(window_mut(&mut room.pieces.rows[Row::<N>::LIGHT + k], first));
            }
            taken.alpha.store_array(window_mut(&mut room.pieces.rows[Row::<N>::LIGHT + 3], first));
            room.pieces.left.push(taken.left);
        }
        let Room { pieces, rows, .. } = room;
        for cut in &pieces.cuts {
            let zero = Floats::splat(simd, 0.0);
            let (mut color, mut alpha, mut through) = ([zero; 3], zero, Floats::splat(simd, 1.0));
            let mut gone = cut.left;
            for &(from, mask) in &pieces.rounds[cut.rounds[0]..cut.rounds[1]] {
                let some = mask32x16::from_bitmask(simd, mask);
                let of = |k: usize| load(simd, window(&pieces.rows[Row::<N>::LIGHT + k], from));
                for k in 0..3 {
                    color[k] = through.mul_add(simd.expand_f32x16(of(k), some), color[k]);
                }
                let absorbed = through * simd.expand_f32x16(of(3), some);
                alpha += absorbed;
                through -= absorbed;
                gone |= pieces.left_of(from, mask);
            }
            let keep = !mask32x16::from_bitmask(simd, gone);
            for k in 0..3 {
                keep.select(color[k], zero).store_array(window_mut(&mut rows[Row::<N>::LIGHT + k], cut.first));
            }
            keep.select(alpha, zero).store_array(window_mut(&mut rows[Row::<N>::LIGHT + 3], cut.first));
            (0..LANES).filter(|l| gone >> l & 1 == 1).for_each(|l| left(cut.first + l));
        }
        pieces.cuts.clear();
        pieces.rounds.clear();
        pieces.left.clear();
        pieces.count = 0;
        panels
    }
}

impl Pieces {
    /// Puts pieces of the `open` segments behind the others: where they begin, their lengths, and the panels that bends ask for.
    #[inline(always)]
    fn put<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        segments: &Segments<S, N>,
        [u, h, bend]: [Floats<S>; 3],
        open: mask32x16<S>,
    ) {
        let at = self.count;
        let mut put = |row: usize, v: Floats<S>| {
            simd.compress_f32x16(v, open).store_array(window_mut(&mut self.rows[row], at));
        };
        for n in 0..N {
            put(Row::<N>::AT + n, segments.rise[n].mul_add(u, segments.at[n]));
            put(Row::<N>::RISE + n, segments.rise[n] * h);
        }
        put(Row::<N>::LENGTH, segments.length * h);
        put(Row::<N>::FIRST, bend);
        if N == 5 {
            for k in 0..3 {
                put(Row::<N>::ALONG + k, segments.along[k]);
            }
        }
        let mask = open.to_bitmask();
        self.rounds.push((at, mask));
        self.count += mask.count_ones() as usize;
    }

    /// Of the segments of a round those whose piece must be taken one by one, a bit each.
    #[inline(always)]
    fn left_of(&self, from: usize, mask: u64) -> u64 {
        let words = [from / LANES, from.div_ceil(LANES)].map(|w| self.left.get(w).copied().unwrap_or(0));
        if words == [0; 2] {
            return 0;
        }
        let (mut bits, mut rest) = (0, mask);
        for at in from..from + mask.count_ones() as usize {
            let lane = rest & rest.wrapping_neg();
            if self.left[at / LANES] >> (at % LANES) & 1 == 1 {
                bits |= lane;
            }
            rest ^= lane;
        }
        bits
    }
}
