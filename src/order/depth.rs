//! Order by depth: a stable radix sort, parallel, of one key for each cell.
//!
//! A key is a number without sign that falls as the cell's depth rises, so that ascending keys are back to front. Cells
//! of equal keys stay as they are stored, so that every run draws the same.

use super::{MOST_PARTS, PART, Provenance, VisibilityOrder};
use rayon::prelude::*;

/// The key of a cell that is not drawn. The last bits of any other, as many as [`MOST_PARTS`] needs, are one less than the
/// number of its parts.
pub const HIDDEN: u32 = u32::MAX;

/// Bits of a key that one pass sorts by at most.
const BITS: u32 = 11;

/// Cells that one task handles at least.
const LEAST: usize = 1 << 14;

/// A key and its entry.
type Item = (u32, u32);

/// How many of `n` one task handles.
fn block_of(n: usize) -> usize {
    n.div_ceil(4 * rayon::current_num_threads()).max(LEAST)
}

/// The order that `keys` say, one for each cell; without `sort`, that in which the cells are stored.
pub fn order(keys: &[u32], sort: bool) -> VisibilityOrder {
    let block = block_of(keys.len());
    let blocks: Vec<Vec<Item>> = keys
        .par_chunks(block)
        .enumerate()
        .map(|(i, part)| {
            let mut items = Vec::with_capacity(part.len());
            for (&key, cell) in part.iter().zip((i * block) as u32..) {
                if key != HIDDEN {
                    (0..=key % MOST_PARTS).for_each(|part| items.push((key, cell | part << PART)));
                }
            }
            items
        })
        .collect();
    let digits = if sort { digits_of(&blocks) } else { vec![] };
    let provenance = if sort { Provenance::Depth } else { Provenance::None };
    let entries = sorted(blocks, &digits).into_par_iter().map(|(_, entry)| entry).collect();
    VisibilityOrder { entries, provenance }
}

/// The digits that keys are sorted by: the bit where each begins, and how many values it has. Depths of a frame have
/// their first bits in common.
fn digits_of(blocks: &[Vec<Item>]) -> Vec<(u32, usize)> {
    let either = |a: (u32, u32), b: (u32, u32)| (a.0 & b.0, a.1 | b.1);
    let none = (u32::MAX, 0);
    let bits = blocks.par_iter().map(|part| part.iter().fold(none, |bits, &(key, _)| either(bits, (key, key))));
    let (all, any) = bits.reduce(|| none, either);
    let differing = u32::BITS - (any & !all).leading_zeros();
    let count = differing.div_ceil(BITS).max(1);
    let bits = differing.div_ceil(count);
    (0..count).map(|i| (i * bits, 1 << bits)).collect()
}

/// The items of all blocks in ascending order of their keys' digits; equal ones stay in sequence.
fn sorted(blocks: Vec<Vec<Item>>, digits: &[(u32, usize)]) -> Vec<Item> {
    let n = blocks.iter().map(Vec::len).sum();
    let [mut items, mut other] = [(); 2].map(|()| vec![(0, 0); n]);
    let blocks: Vec<&[Item]> = blocks.iter().map(Vec::as_slice).collect();
    // Without digits, one of a single value: they are joined.
    pass(&blocks, &mut items, *digits.first().unwrap_or(&(0, 1)));
    for &digit in digits.iter().skip(1) {
        pass(&items.chunks(block_of(n)).collect::<Vec<_>>(), &mut other, digit);
        std::mem::swap(&mut items, &mut other);
    }
    items
}

/// Sorts the items of `blocks` by one digit.
fn pass(blocks: &[&[Item]], to: &mut [Item], (shift, digits): (u32, usize)) {
    let digit = |item: &Item| (item.0 >> shift) as usize & (digits - 1);
    let counts: Vec<Vec<u32>> = blocks
        .par_iter()
        .map(|part| {
            let mut counts = vec![0; digits];
            part.iter().for_each(|item| counts[digit(item)] += 1);
            counts
        })
        .collect();
    // Where each block puts its items of each digit: digits first, then blocks, so that equal ones stay in sequence.
    let mut places: Vec<Vec<&mut [Item]>> = counts.iter().map(|_| Vec::with_capacity(digits)).collect();
    let mut rest = to;
    for d in 0..digits {
        for (places, counts) in places.iter_mut().zip(&counts) {
            let (own, others) = rest.split_at_mut(counts[d] as usize);
            places.push(own);
            rest = others;
        }
    }
    blocks.par_iter().zip(places).for_each(|(part, mut places)| {
        for item in *part {
            let place = &mut places[digit(item)];
            if let Some((next, others)) = std::mem::take(place).split_first_mut() {
                *next = *item;
                *place = others;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The same by the standard library's stable sort.
    fn expected(keys: &[u32]) -> Vec<u32> {
        let mut items: Vec<Item> = keys.iter().copied().zip(0..).filter(|i| i.0 != HIDDEN).collect();
        items.sort_by_key(|i| i.0);
        items.iter().flat_map(|&(key, cell)| (0..=key % MOST_PARTS).map(move |part| cell | part << PART)).collect()
    }

    proptest! {
        #[test]
        fn orders_as_a_stable_sort_does(keys in prop::collection::vec(prop_oneof![any::<u32>(), 0..9u32, Just(HIDDEN)], 0..3000)) {
            let order = order(&keys, true);
            prop_assert_eq!(order.provenance, Provenance::Depth);
            prop_assert_eq!(order.entries, expected(&keys));
        }
    }

    #[test]
    fn many_blocks_are_one_order() {
        // Few keys, many of each: a block out of sequence would show.
        let keys: Vec<u32> = (0..300_000u32).map(|i| i.wrapping_mul(0x9e37_79b9) >> 25 << 20).collect();
        assert_eq!(order(&keys, true).entries, expected(&keys));
        let seen: Vec<u32> = (0..300_000).filter(|&i| keys[i as usize] & 1 == 0).collect();
        assert_eq!(order(&keys, false).entries, seen);
    }
}
