//! Numbers dealt into buckets, in parallel: the first step of sorting and matching much.

use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// The numbers 0..n dealt into buckets, ascending in each.
pub(crate) struct Buckets {
    items: Vec<AtomicU32>,
    /// Bucket `b` is `items[starts[b]..starts[b + 1]]`.
    starts: Vec<usize>,
}

impl Buckets {
    /// Deals the numbers below `n` by `bucket`, which tells the buckets that each is to be in.
    pub(crate) fn new<const K: usize>(
        n: usize,
        buckets: usize,
        bucket: impl Fn(u32) -> [Option<usize>; K] + Sync,
    ) -> Self {
        let chunk = (n / 256).max(1 << 16);
        let range = |c: usize| (c * chunk) as u32..n.min((c + 1) * chunk) as u32;
        let mut next: Vec<Vec<u32>> = (0..n.div_ceil(chunk))
            .into_par_iter()
            .map(|c| {
                let mut counts = vec![0; buckets];
                range(c).flat_map(&bucket).flatten().for_each(|b| counts[b] += 1);
                counts
            })
            .collect();
        let mut starts = Vec::with_capacity(buckets + 1);
        let mut at = 0;
        for b in 0..buckets {
            starts.push(at as usize);
            for counts in &mut next {
                at += std::mem::replace(&mut counts[b], at);
            }
        }
        starts.push(at as usize);
        // Each place is written once, by one thread: atomics only let several threads hold the vector.
        let items: Vec<AtomicU32> = (0..at).into_par_iter().map(|_| AtomicU32::new(0)).collect();
        next.par_iter_mut().enumerate().for_each(|(c, next)| {
            for i in range(c) {
                for b in bucket(i).into_iter().flatten() {
                    items[next[b] as usize].store(i, Relaxed);
                    next[b] += 1;
                }
            }
        });
        Buckets { items, starts }
    }

    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    pub(crate) fn items(&self, b: usize) -> impl Iterator<Item = u32> + '_ {
        self.items[self.starts[b]..self.starts[b + 1]].iter().map(|i| i.load(Relaxed))
    }
}
