//! Order by depth: a stable radix sort, parallel, of one key for each cell.
//!
//! A key is a number without sign that falls as the cell's depth rises, so that ascending keys are back to front. Cells
//! of equal keys stay as they are stored, so that every run draws the same.

use super::{Provenance, VisibilityOrder};
use rayon::prelude::*;

/// The key of a cell that is not drawn.
pub const HIDDEN: u32 = u32::MAX;

/// Parts that a cell is drawn in at most, a power of two: the last bits of its key are one less than its number of parts.
pub const MOST_PARTS: u32 = 4;

/// Bits of a key that one pass sorts by at most.
const BITS: u32 = 11;

/// Cells that one task handles at least.
const LEAST: usize = 1 << 14;

/// A key and its cell.
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
                    (0..=key % MOST_PARTS).for_each(|_| items.push((key, cell)));
                }
            }
            items
        })
        .collect();
    let items = blocks.concat();
    let (items, provenance) = if sort { (sorted(items), Provenance::Depth) } else { (items, Provenance::None) };
    VisibilityOrder { cells: items.into_iter().map(|(_, cell)| cell).collect(), provenance }
}

/// `items` in ascending order of their keys; equal ones stay in sequence.
fn sorted(mut items: Vec<Item>) -> Vec<Item> {
    let mut other = vec![(0, 0); items.len()];
    // Depths of a frame have their first bits in common.
    let (all, any) = items.iter().fold((!0, 0), |(all, any), item| (all & item.0, any | item.0));
    let differing = u32::BITS - (all ^ any).leading_zeros();
    let bits = differing.div_ceil(differing.div_ceil(BITS).max(1)).max(1);
    for shift in (0..differing).step_by(bits as usize) {
        pass(&items, &mut other, shift, 1 << bits);
        std::mem::swap(&mut items, &mut other);
    }
    items
}

/// Sorts by one digit, of so many there are.
fn pass(from: &[Item], to: &mut [Item], shift: u32, digits: usize) {
    let digit = |item: &Item| (item.0 >> shift) as usize & (digits - 1);
    let block = block_of(from.len());
    let counts: Vec<Vec<u32>> = from
        .par_chunks(block)
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
    from.par_chunks(block).zip(places).for_each(|(part, mut places)| {
        for item in part {
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
        items.iter().flat_map(|&(key, cell)| vec![cell; (key % MOST_PARTS) as usize + 1]).collect()
    }

    proptest! {
        #[test]
        fn orders_as_a_stable_sort_does(keys in prop::collection::vec(prop_oneof![any::<u32>(), 0..9u32, Just(HIDDEN)], 0..3000)) {
            let order = order(&keys, true);
            prop_assert_eq!(order.provenance, Provenance::Depth);
            prop_assert_eq!(order.cells, expected(&keys));
        }
    }

    #[test]
    fn many_blocks_are_one_order() {
        // Few keys, many of each: a block out of sequence would show.
        let keys: Vec<u32> = (0..300_000u32).map(|i| i.wrapping_mul(0x9e37_79b9) >> 25 << 20).collect();
        assert_eq!(order(&keys, true).cells, expected(&keys));
        let seen: Vec<u32> = (0..300_000).filter(|&i| keys[i as usize] & 1 == 0).collect();
        assert_eq!(order(&keys, false).cells, seen);
    }
}
