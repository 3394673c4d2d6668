//! Letters as lines of a pen, so that they are sharp at any size.
//!
//! A glyph is a list of polylines, separated by commas. Each point is two hexadecimal digits: its distance to the right, and its height.
//! The baseline is at 3; small letters reach up to 9, capitals and digits to 12, and descenders down to 0.

/// Height of a capital.
pub(super) const CAPITAL: f64 = 9.0;
/// Where letters stand.
const BASE: f64 = 3.0;
/// From the right of a glyph to the left of the next.
const BETWEEN: f64 = 2.6;
/// Width of a blank, with what is between glyphs.
const BLANK: f64 = 4.5;
/// The glyph of unknown characters.
const UNKNOWN: &str = "030c6c6303";

/// The glyphs; a blank has none.
const GLYPHS: [(char, &str); 130] = [
    ('0', "2c3c5a553323050a2c"),
    ('1', "1a3c33,1353"),
    ('2', "0a2c3c5a580353"),
    ('3', "0b2c3c5a59385755332304,1838"),
    ('4', "434c0656"),
    ('5', "5c0c08395755332304"),
    ('6', "4c2b080523335556382806"),
    ('7', "0c5c23"),
    ('8', "28090a2c3c5a59382806052333555638"),
    ('9', "1334575a3c2c0a09273759"),
    ('A', "033c63,1656"),
    ('B', "030c4c6a694808,4866654303"),
    ('C', "6a4c2c0a05234365"),
    ('D', "030c3c69663303"),
    ('E', "63030c6c,0848"),
    ('F', "030c6c,0848"),
    ('G', "6a4c2c0a052343656737"),
    ('H', "030c,636c,0868"),
    ('I', "0343,0c4c,232c"),
    ('J', "5c55332305"),
    ('K', "030c,6c0763"),
    ('L', "0c0363"),
    ('M', "030c376c63"),
    ('N', "030c636c"),
    ('O', "2c4c6a654323050a2c"),
    ('P', "030c4c6a694707"),
    ('Q', "2c4c6a654323050a2c,3562"),
    ('R', "030c4c6a694707,3763"),
    ('S', "6a4c2c0a0928476665432305"),
    ('T', "0c6c,3c33"),
    ('U', "0c052343656c"),
    ('V', "0c336c"),
    ('W', "0c234a638c"),
    ('X', "036c,0c63"),
    ('Y', "0c386c,3833"),
    ('Z', "0c6c0363"),
    ('a', "5953,5839290705233354"),
    ('b', "0c03,0829395755332304"),
    ('c', "5839290705233354"),
    ('d', "5c53,5839290705233354"),
    ('e', "06565739290705233354"),
    ('f', "4c3c2b23,0949"),
    ('g', "5952302001,5839290705233354"),
    ('h', "0c03,0829395753"),
    ('i', "0903,0c0c"),
    ('ı', "0903"),
    ('j', "29211000,2c2c"),
    ('k', "0c03,4905,2753"),
    ('l', "0c041323"),
    ('m', "0903,0829394843,4869798883"),
    ('n', "0903,0829395753"),
    ('o', "293957553323050729"),
    ('p', "0900,0829395755332304"),
    ('q', "5950,5839290705233354"),
    ('r', "0903,072949"),
    ('s', "584919080716465554431304"),
    ('t', "2c243343,0949"),
    ('u', "0905233354,5953"),
    ('v', "093369"),
    ('w', "0923486389"),
    ('x', "0953,0359"),
    ('y', "0933,6933211000"),
    ('z', "09590353"),
    ('!', "0c06,0303"),
    ('"', "0c0a,2c2a"),
    ('#', "132c,435c,0666,0969"),
    ('$', "6a4c2c0a0928476665432305,3d32"),
    ('%', "036c,0b1c2b1a0b,4455645344"),
    ('&', "631a1b2c3c4b4a0604133366"),
    ('\'', "0c0a"),
    ('(', "2d0a0522"),
    (')', "0d2a2502"),
    ('*', "2b25,0a46,4a06"),
    ('+', "0767,3a34"),
    (',', "1301"),
    ('-', "0747"),
    ('−', "0757"),
    ('.', "0303"),
    ('/', "025d"),
    (':', "0303,0808"),
    (';', "1301,1818"),
    ('<', "5a0754"),
    ('=', "0858,0555"),
    ('>', "0a5704"),
    ('?', "0a2c3c5a593736,3333"),
    ('@', "543323050a2c4c6a66554649,483928273647"),
    ('[', "2d0d0222"),
    ('\\', "0d52"),
    (']', "0d2d2202"),
    ('^', "0a2c4a"),
    ('_', "0161"),
    ('`', "0c1b"),
    ('{', "3d2d1c180716132232"),
    ('|', "0d01"),
    ('}', "0d1d2c283726231202"),
    ('~', "07294769"),
    ('°', "1c2b1a0b1c"),
    ('²', "0b1c2b0828"),
    ('³', "0c2c1a291808"),
    ('µ', "0900,05233354,5953"),
    ('±', "0959,2c26,0353"),
    ('·', "0707"),
    ('×', "0448,0844"),
    ('→', "0767,496745"),
    ('≤', "5b0855,0353"),
    ('≥', "0b5805,0353"),
    ('ß', "030a1c3c4b4a284756544323"),
    ('Ø', "2c4c6a654323050a2c,036c"),
    ('ø', "293957553323050729,0359"),
    ('Γ', "030c5c"),
    ('Δ', "033c6303"),
    ('Θ', "2c4c6a654323050a2c,1858"),
    ('Λ', "033c63"),
    ('Π', "030c6c63"),
    ('Σ', "6c0c480363"),
    ('Ω', "032325080a2c4c6a68454363"),
    ('α', "69554323050729395563"),
    ('β', "000a2c3c5a4828,485655332305"),
    ('γ', "09193530,3569"),
    ('δ', "4b2c1b1a5755332305062838"),
    ('ε', "58492908072646,260504234354"),
    ('θ', "2c3c5a553323050a2c,0757"),
    ('λ', "0c1c63,3803"),
    ('μ', "0900,05233354,5953"),
    ('π', "0969,1913,5953"),
    ('ρ', "000729395755332304"),
    ('σ', "692907052343555749"),
    ('τ', "0959,29243343"),
    ('φ', "293957553323050729,3c30"),
    ('ω', "19070513233538,354353656759"),
];

/// A mark above or below letters.
struct Mark {
    /// The letters that have it, and the same ones without it, of which the small i has no dot.
    marked: &'static str,
    plain: &'static str,
    /// Its lines, as those of glyphs: to the right of 2, which is the middle of the letter, and above 0, which is its top or its foot.
    lines: &'static [&'static [[f64; 2]]],
    is_below: bool,
}

/// From the top of a letter to its mark.
const ABOVE: f64 = 1.2;

const MARKS: [Mark; 8] = [
    Mark { marked: "ÀÈÌÒÙàèìòù", plain: "AEIOUaeıou", lines: &[&[[1.0, 2.0], [3.0, 0.0]]], is_below: false },
    Mark {
        marked: "ÁÉÍÓÚÝáéíóúýĆćŃńŚśŹźŐőŰű",
        plain: "AEIOUYaeıouyCcNnSsZzOoUu",
        lines: &[&[[1.0, 0.0], [3.0, 2.0]]],
        is_below: false,
    },
    Mark {
        marked: "ÂÊÎÔÛâêîôû",
        plain: "AEIOUaeıou",
        lines: &[&[[0.5, 0.0], [2.0, 2.0], [3.5, 0.0]]],
        is_below: false,
    },
    Mark {
        marked: "ČčĚěŘřŠšŽžŇňĎďŤť",
        plain: "CcEeRrSsZzNnDdTt",
        lines: &[&[[0.5, 2.0], [2.0, 0.0], [3.5, 2.0]]],
        is_below: false,
    },
    Mark {
        marked: "ÃÑÕãñõ",
        plain: "ANOano",
        lines: &[&[[0.0, 0.0], [1.0, 1.2], [3.0, 0.0], [4.0, 1.2]]],
        is_below: false,
    },
    Mark {
        marked: "ÄËÏÖÜäëïöüÿ",
        plain: "AEIOUaeıouy",
        lines: &[&[[0.8, 1.0], [0.8, 1.0]], &[[3.2, 1.0], [3.2, 1.0]]],
        is_below: false,
    },
    Mark {
        marked: "ÅåŮů",
        plain: "AaUu",
        lines: &[&[[2.0, -0.4], [0.9, 0.7], [2.0, 1.8], [3.1, 0.7], [2.0, -0.4]]],
        is_below: false,
    },
    Mark {
        marked: "ÇçŞş",
        plain: "CcSs",
        lines: &[&[[2.0, 0.0], [2.0, -1.0], [3.0, -2.0], [1.2, -2.6]]],
        is_below: true,
    },
];

/// A letter without its mark, and the mark.
fn parted(character: char) -> (char, Option<&'static Mark>) {
    let find = |mark: &'static Mark| {
        let at = mark.marked.chars().position(|marked| marked == character)?;
        mark.plain.chars().nth(at).map(|plain| (plain, Some(mark)))
    };
    MARKS.iter().find_map(find).unwrap_or((character, None))
}

/// The lines of a mark over or under a letter.
fn mark_lines(letter: char, mark: &'static Mark) -> impl Iterator<Item = [[f64; 2]; 2]> + Clone {
    let ends = || letter_lines(letter).flatten();
    let middle = 0.5 * ends().fold(0.0, |most: f64, [right, _]| most.max(right));
    let top = ends().fold(0.0, |most: f64, [_, up]| most.max(up));
    let height = if mark.is_below { 0.0 } else { top + ABOVE };
    let placed = move |[right, up]: [f64; 2]| [middle + right - 2.0, height + up];
    mark.lines.iter().flat_map(|line| line.windows(2)).map(move |ends| [placed(ends[0]), placed(ends[1])])
}

/// The lines of a glyph; `None` for a blank.
fn drawn(character: char) -> Option<&'static str> {
    let glyph = GLYPHS.iter().find(|(known, _)| *known == character);
    (character != ' ').then(|| glyph.map_or(UNKNOWN, |(_, lines)| lines))
}

/// The lines of a character from end to end: to the right of where it begins, and above the line that it stands on.
pub(super) fn lines(character: char) -> impl Iterator<Item = [[f64; 2]; 2]> + Clone {
    let (letter, mark) = parted(character);
    letter_lines(letter).chain(mark.into_iter().flat_map(move |mark| mark_lines(letter, mark)))
}

/// The same of a character without a mark.
fn letter_lines(character: char) -> impl Iterator<Item = [[f64; 2]; 2]> + Clone {
    let polylines = drawn(character).into_iter().flat_map(|glyph| glyph.split(','));
    polylines
        .flat_map(|polyline| {
            let point = |digits: &[u8]| {
                let [right, up] = [0, 1].map(|i| char::from(digits[i]).to_digit(16).map_or(0.0, f64::from));
                [right, up - BASE]
            };
            let points = polyline.as_bytes().chunks_exact(2).map(point);
            points.clone().zip(points.skip(1))
        })
        .map(|(from, to)| [from, to])
}

/// How far after a character the next begins.
pub(super) fn advance(character: char) -> f64 {
    if drawn(character).is_none() {
        return BLANK;
    }
    let (letter, _) = parted(character);
    letter_lines(letter).flatten().fold(0.0, |most: f64, [right, _]| most.max(right)) + BETWEEN
}

/// Whether a character is drawn as itself, not as a box.
pub(super) fn is_known(character: char) -> bool {
    let (letter, _) = parted(character);
    drawn(letter) != Some(UNKNOWN)
}

/// Width of a text.
pub(super) fn width(text: &str) -> f64 {
    text.chars().map(advance).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_character_of_ascii_has_lines_of_its_own() {
        let mut known: Vec<&str> = (' '..='~').filter_map(drawn).collect();
        assert_eq!(known.len(), 94);
        known.sort_unstable();
        assert!(known.windows(2).all(|pair| pair[0] != pair[1]));
        assert!(!known.contains(&UNKNOWN) && drawn('語') == Some(UNKNOWN));
    }

    #[test]
    fn lines_are_pairs_of_digits_within_the_height_of_a_line() {
        for character in GLYPHS.map(|(character, _)| character) {
            for polyline in drawn(character).into_iter().flat_map(|glyph| glyph.split(',')) {
                assert!(polyline.len() >= 4 && polyline.len() % 2 == 0, "{character}: {polyline}");
                assert!(polyline.bytes().all(|b| b.is_ascii_hexdigit()), "{character}: {polyline}");
            }
            for [right, up] in lines(character).flatten() {
                assert!(right <= 8.0 && (-3.0..=10.0).contains(&up), "{character}: {right} {up}");
            }
        }
    }

    #[test]
    fn letters_with_marks_are_letters_with_lines_above_or_below() {
        for mark in &MARKS {
            assert_eq!(mark.marked.chars().count(), mark.plain.chars().count(), "{}", mark.marked);
            for (marked, plain) in mark.marked.chars().zip(mark.plain.chars()) {
                assert!(is_known(marked) && is_known(plain), "{marked}");
                assert_eq!(advance(marked), advance(plain), "{marked}");
                let heights = |character: char| lines(character).flatten().map(|[_, up]| up);
                let [top, foot] = [heights(plain).fold(0.0, f64::max), heights(plain).fold(0.0, f64::min)];
                assert!(heights(marked).any(|up| up > top || up < foot), "{marked}");
            }
        }
        assert!(!is_known('名') && is_known(' '));
    }

    #[test]
    fn digits_are_as_wide_as_each_other() {
        assert!(('0'..='9').all(|digit| advance(digit) == advance('0')));
        assert!(width("il") < width("mw") && width("") == 0.0);
    }
}
