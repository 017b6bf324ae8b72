// A stable radix sort of keys and the numbers that go with them: for each digit of 4 bits, `count` the digits of each
// block of items, `sum` these counts up, and `scatter` the items. In the first pass keys of SKIPPED are left out.

struct SortPass {
    /// Items at most; in later passes there are `total`, where that is fewer.
    items: u32,
    shift: u32,
    blocks: u32,
    /// Whether numbers are the items' own places.
    is_first: u32,
    row: u32,
}

const ITEMS = 256u;
const ROUNDS = 8u;
const BLOCK = ITEMS * ROUNDS;

@group(0) @binding(0) var<uniform> digits: SortPass;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read> numbers: array<u32>;
@group(0) @binding(3) var<storage, read_write> next_keys: array<u32>;
@group(0) @binding(4) var<storage, read_write> next_numbers: array<u32>;
/// For each digit, of each block.
@group(0) @binding(5) var<storage, read_write> counts: array<u32>;
@group(0) @binding(6) var<storage, read_write> total: array<u32>;

var<workgroup> tally: array<atomic<u32>, 16>;
var<workgroup> before: array<vec4u, 256>;
var<workgroup> places: array<u32, 16>;
var<workgroup> sums: array<u32, 256>;
var<workgroup> last: array<atomic<u32>, 16>;

fn present() -> u32 {
    return select(min(digits.items, total[0]), digits.items, digits.is_first == 1u);
}

fn is_item(i: u32) -> bool {
    return i < present() && (digits.is_first == 0u || keys[i] != SKIPPED);
}

@compute @workgroup_size(256)
fn count(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let block = group.y * digits.row + group.x;
    if block >= digits.blocks {
        return;
    }
    if thread < 16u {
        atomicStore(&tally[thread], 0u);
    }
    workgroupBarrier();
    for (var round = 0u; round < ROUNDS; round++) {
        let i = block * BLOCK + round * ITEMS + thread;
        if is_item(i) {
            atomicAdd(&tally[(keys[i] >> digits.shift) & 15u], 1u);
        }
    }
    workgroupBarrier();
    if thread < 16u {
        counts[thread * digits.blocks + block] = atomicLoad(&tally[thread]);
    }
}

/// One group: each count becomes the sum of those before it.
@compute @workgroup_size(256)
fn sum(@builtin(local_invocation_index) thread: u32) {
    let n = 16u * digits.blocks;
    let own = (n + ITEMS - 1u) / ITEMS;
    let end = min((thread + 1u) * own, n);
    var all = 0u;
    for (var i = thread * own; i < end; i++) {
        all += counts[i];
    }
    sums[thread] = all;
    workgroupBarrier();
    for (var step = 1u; step < ITEMS; step *= 2u) {
        var other = 0u;
        if thread >= step {
            other = sums[thread - step];
        }
        workgroupBarrier();
        sums[thread] += other;
        workgroupBarrier();
    }
    var running = sums[thread] - all;
    for (var i = thread * own; i < end; i++) {
        let c = counts[i];
        counts[i] = running;
        running += c;
    }
    if thread == ITEMS - 1u && digits.is_first == 1u {
        total[0] = sums[thread];
    }
}

@compute @workgroup_size(256)
fn scatter(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let block = group.y * digits.row + group.x;
    if block >= digits.blocks {
        return;
    }
    if thread < 16u {
        places[thread] = counts[thread * digits.blocks + block];
        atomicStore(&last[thread], 0u);
    }
    for (var round = 0u; round < ROUNDS; round++) {
        let i = block * BLOCK + round * ITEMS + thread;
        let takes_part = is_item(i);
        var key = 0u;
        var own = vec4u();
        if takes_part {
            key = keys[i];
        }
        let digit = (key >> digits.shift) & 15u;
        let shift = (digit & 3u) * 8u;
        let quarter = vec4u(digit >> 2u) == vec4u(0u, 1u, 2u, 3u);
        // Sixteen counters of 8 bits: those before an item are at most 255.
        if takes_part {
            own = select(vec4u(), vec4u(1u << shift), quarter);
        }
        before[thread] = own;
        workgroupBarrier();
        // Sums of all before, itself not included; the last thread's own could be the 256th.
        var running = select(before[thread - min(thread, 1u)], vec4u(), thread == 0u);
        workgroupBarrier();
        before[thread] = running;
        workgroupBarrier();
        for (var step = 1u; step < ITEMS; step *= 2u) {
            var other = vec4u();
            if thread >= step {
                other = before[thread - step];
            }
            workgroupBarrier();
            running += other;
            before[thread] = running;
            workgroupBarrier();
        }
        let fours = select(vec4u(), running, quarter);
        let rank = ((fours.x | fours.y | fours.z | fours.w) >> shift) & 255u;
        if takes_part {
            let to = places[digit] + rank;
            next_keys[to] = key;
            var number = i;
            if digits.is_first == 0u {
                number = numbers[i];
            }
            next_numbers[to] = number;
        }
        workgroupBarrier();
        if takes_part {
            // As often as there are items: the last of each digit leaves one more than its rank.
            atomicMax(&last[digit], rank + 1u);
        }
        workgroupBarrier();
        if thread < 16u {
            places[thread] += atomicExchange(&last[thread], 0u);
        }
        workgroupBarrier();
    }
}
