//! Round numbers of a range, and the texts beside them.

/// From here on whole numbers are written with an exponent.
const LONG: f64 = 1e7;
/// The first digit after the point that is written without an exponent.
const FINE: i32 = -6;
/// How many digits more than ticks the numbers at the ends have.
const FINER: i32 = 2;
/// Share of the distance of ticks that is rounding.
const ROUNDING: f64 = 1e-9;

/// Ticks of a range: numbers with their texts, rising.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ticks {
    /// The two ends, as they are.
    pub(super) ends: [(f64, String); 2],
    /// Multiples of 1, 2 or 5 times a power of ten within the range.
    pub(super) round: Vec<(f64, String)>,
}

impl Ticks {
    /// Those of a range, of which at most so many are round; of one number alone that is all.
    pub(super) fn new(range: [f64; 2], most: usize) -> Self {
        let [low, high] = range;
        let span = high - low;
        if !(span > 0.0 && span.is_finite() && most > 0) {
            let digit = last_digit(low.abs().max(high.abs())) - 3;
            return Self { ends: [low, high].map(|end| (end, trimmed(written(end, digit)))), round: Vec::new() };
        }
        let (step, digit) = step(span / most as f64);
        let first = (low / step - ROUNDING).ceil();
        let last = high + ROUNDING * step;
        let numbers = (0..=most).map(|i| (first + i as f64) * step).take_while(|number| *number <= last);
        Self {
            ends: [low, high].map(|end| (end, trimmed(written(end, digit - FINER)))),
            round: numbers.map(|number| (number, written(number, digit))).collect(),
        }
    }
}

impl Ticks {
    /// Ticks of a logarithmic range, which lies above 0: powers of ten, and 2 and 5 times these where there are few.
    pub(super) fn of_powers(range: [f64; 2], most: usize) -> Self {
        let [low, high] = range;
        if !(low > 0.0 && high > low && high.is_finite()) {
            return Self::new(range, 0);
        }
        let digits = last_digit(low)..=last_digit(high);
        let within = |times: f64, digit: i32| {
            let number = times * libm::pow(10.0, f64::from(digit));
            (low..=high).contains(&number).then(|| (number, written(number, digit)))
        };
        let fine = digits.clone().flat_map(|digit| [1.0, 2.0, 5.0].map(|times| within(times, digit)));
        let fine: Vec<(f64, String)> = fine.flatten().collect();
        let every = digits.clone().count().div_ceil(most.max(1));
        let round = match fine.len() <= most {
            true => fine,
            false => digits.step_by(every).filter_map(|digit| within(1.0, digit)).collect(),
        };
        Self { ends: [low, high].map(|end| (end, trimmed(written(end, last_digit(end) - FINER)))), round }
    }
}

/// The least of 1, 2 and 5 times a power of ten that is not below a distance, and that power.
fn step(distance: f64) -> (f64, i32) {
    let digit = last_digit(distance);
    let unit = libm::pow(10.0, f64::from(digit));
    let fits = |times: &f64| times * unit >= distance * (1.0 - ROUNDING);
    [1.0, 2.0, 5.0].into_iter().find(fits).map_or((10.0 * unit, digit + 1), |times| (times * unit, digit))
}

/// The power of ten of the first digit of a number.
fn last_digit(number: f64) -> i32 {
    if number > 0.0 { libm::log10(number).floor() as i32 } else { 0 }
}

/// A number to the digit of a power of ten.
fn written(number: f64, digit: i32) -> String {
    if number == 0.0 {
        return "0".to_owned();
    }
    if number.abs() >= LONG || digit < FINE {
        let digits = (last_digit(number.abs()) - digit).clamp(0, 15) as usize;
        return trimmed(format!("{number:.digits$e}"));
    }
    let text = format!("{number:.*}", (-digit).max(0) as usize);
    // What is rounded to nothing has no sign.
    let is_zero = text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// Without zeros at the end of its fraction.
fn trimmed(text: String) -> String {
    let (number, exponent) = text.split_once('e').map_or((text.as_str(), None), |(n, e)| (n, Some(e)));
    let number = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    exponent.map_or(number.to_owned(), |exponent| format!("{number}e{exponent}"))
}

/// A whole number.
pub(super) fn whole(number: f64) -> String {
    written(number, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(range: [f64; 2], most: usize) -> (Vec<String>, Vec<String>) {
        let ticks = Ticks::new(range, most);
        (ticks.ends.map(|(_, text)| text).into(), ticks.round.into_iter().map(|(_, text)| text).collect())
    }

    #[test]
    fn ticks_are_at_ones_twos_and_fives_and_the_ends_are_told_finer() {
        let (ends, round) = texts([405.26, 513.871], 6);
        assert_eq!(ends, ["405.3", "513.9"]);
        assert_eq!(round, ["420", "440", "460", "480", "500"]);
        let (ends, round) = texts([-0.012, 0.0301], 4);
        assert_eq!(ends, ["-0.012", "0.0301"]);
        assert_eq!(round, ["0", "0.02"]);
        assert_eq!(texts([0.0, 255.0], 6).1, ["0", "50", "100", "150", "200", "250"]);
    }

    #[test]
    fn there_are_never_more_than_asked_for_and_the_same_for_a_range_in_other_units() {
        for (low, high) in [(0.0, 1.0), (-3.0, 7.0), (1.1, 1.2), (637_000.0, 637_500.0)] {
            for most in 1..12 {
                let ticks = Ticks::new([low, high], most);
                assert!(ticks.round.len() <= most + 1, "{low} {high} {most}: {ticks:?}");
                let around = 1e-6 * (high - low);
                assert!(ticks.round.iter().all(|(n, _)| (low - around..high + around).contains(n)), "{ticks:?}");
                let kilo = Ticks::new([1000.0 * low, 1000.0 * high], most);
                assert_eq!(kilo.round.len(), ticks.round.len(), "{low} {high} {most}");
            }
        }
    }

    #[test]
    fn large_and_small_numbers_have_exponents_and_no_more_digits_than_they_need() {
        assert_eq!(texts([0.0, 1e9], 4).0, ["0", "1e9"]);
        assert_eq!(texts([0.0, 1e9], 4).1, ["0", "5e8", "1e9"]);
        assert_eq!(texts([2e-9, 8e-9], 3).0, ["2e-9", "8e-9"]);
        assert_eq!(texts([5.0, 5.0], 4), (vec!["5".to_owned(); 2], Vec::new()));
        assert_eq!(texts([f64::MIN, f64::MAX], 4).1, Vec::<String>::new());
        assert_eq!([whole(2.0), whole(-7.0), whole(1e12)], ["2", "-7", "1e12"]);
    }
}
