//! Sorting the entries of one cell by distance, by whichever way suits their number.
//!
//! A key holds the distance in its upper half: positive floats, ordered as integers. The content of the lower half does
//! not matter, and the order of equal distances is free: exact sums merge them.

/// Lists up to these lengths are sorted by counting.
const SHORT: [usize; 2] = [64, 128];
/// Keys that are counted at once.
const LANES: usize = 16;
/// Lists from this length on are sorted by long digits, all others by short ones.
const LONG: usize = 1024;
/// Most bits of a digit.
const SHORT_DIGIT: u32 = 8;
const LONG_DIGIT: u32 = 11;

/// Sorts by distance; no key is 0.
#[inline(always)]
pub(crate) fn sort(list: &mut [u64], spare: &mut Vec<u64>) {
    match list.len() {
        0..=1 => {}
        n if n <= SHORT[0] => sort_short::<{ SHORT[0] }>(list),
        n if n <= SHORT[1] => sort_short::<{ SHORT[1] }>(list),
        n if n < LONG => _ = sort_long::<SHORT_DIGIT, { 1 << SHORT_DIGIT }>(list, spare),
        _ => _ = sort_long::<LONG_DIGIT, { 1 << LONG_DIGIT }>(list, spare),
    }
}

/// Counts for each key how many are less, several at a time and without a branch.
#[inline(always)]
fn sort_short<const MOST: usize>(list: &mut [u64]) {
    let n = list.len();
    let mut distance = [i32::MAX; MOST];
    distance.iter_mut().zip(&*list).for_each(|(d, key)| *d = (key >> 32) as i32);
    let mut sorted = [0u64; MOST];
    for (chunk, keys) in distance.chunks_exact(LANES).zip(list.chunks(LANES)) {
        let mut less = [0i32; LANES];
        for other in &distance[..n] {
            (0..LANES).for_each(|l| less[l] += i32::from(*other < chunk[l]));
        }
        for (key, less) in keys.iter().zip(less) {
            let mut rank = less as usize;
            // Equal distances take one place after the other.
            while sorted[rank] != 0 {
                rank += 1;
            }
            sorted[rank] = *key;
        }
    }
    list.copy_from_slice(&sorted[..n]);
}

/// By digits, from the lowest; the number of passes, each of which moves every key once.
#[inline(never)]
fn sort_long<const DIGIT: u32, const VALUES: usize>(list: &mut [u64], spare: &mut Vec<u64>) -> u32 {
    // Distances of one cell differ in their low bits alone.
    let (least, most) = list.iter().fold((u64::MAX, 0), |(a, b), k| (a.min(*k), b.max(*k)));
    let least = least >> 32;
    let significant = u64::BITS - ((most >> 32) - least).leading_zeros();
    let passes = significant.div_ceil(DIGIT);
    let bits = significant.div_ceil(passes.max(1));
    if spare.len() < list.len() {
        spare.resize(list.len(), 0);
    }
    let spare = &mut spare[..list.len()];
    for pass in 0..passes {
        let digit = |k: u64| (((k >> 32) - least) >> (pass * bits)) as usize & ((1 << bits) - 1);
        if pass % 2 == 0 { scatter::<VALUES>(list, spare, digit) } else { scatter::<VALUES>(spare, list, digit) }
    }
    if passes % 2 == 1 {
        list.copy_from_slice(spare);
    }
    passes
}

/// One stable counting pass.
fn scatter<const VALUES: usize>(from: &[u64], to: &mut [u64], digit: impl Fn(u64) -> usize) {
    let mut next = [0u32; VALUES];
    from.iter().for_each(|k| next[digit(*k) % VALUES] += 1);
    let mut sum = 0;
    for slot in &mut next {
        sum += std::mem::replace(slot, sum);
    }
    for &key in from {
        let slot = &mut next[digit(key) % VALUES];
        to[*slot as usize] = key;
        *slot += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ts06_every_length_is_sorted_with_equal_distances_and_any_spread() {
        let mut spare = Vec::new();
        for n in (0..300).chain([1000, 1023, 1024, 5000]) {
            for spread in [0, 1, 3, 9, 17, 30] {
                let distance =
                    |i: u64| 1 + (splat_core::rng::bits(6, n, i, 0) >> (64 - spread.max(1))) * u64::from(spread > 0);
                let mut list: Vec<u64> = (0..n).map(|i| distance(i) << 32 | i).collect();
                let mut expected = list.clone();
                sort(&mut list, &mut spare);
                assert!(list.is_sorted_by_key(|k| k >> 32), "{n} keys of {spread} bits");
                list.sort_unstable();
                expected.sort_unstable();
                assert_eq!(list, expected, "{n} keys of {spread} bits");
            }
        }
    }

    #[test]
    fn ts06_twice_the_points_of_a_cell_take_twice_the_steps() {
        for n in [LONG, 20_000, 40_000, 80_000] {
            let key = |i: u64| (u64::from(splat_core::rng::unit_f32(6, 1, i, 0).to_bits()) << 32) | 1;
            let mut list: Vec<u64> = (0..n as u64).map(key).collect();
            let passes = sort_long::<LONG_DIGIT, { 1 << LONG_DIGIT }>(&mut list, &mut Vec::new());
            assert!(list.is_sorted() && passes <= 3, "{n} keys: {passes} passes");
        }
    }
}
