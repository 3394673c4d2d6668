//! A legend over the right border of a displayed picture, or in a strip beside it: the bar of a colour map with its numbers, or the
//! colours of whole numbers.
//!
//! All lengths follow from the picture's shorter side, so the legend scales with the picture. Panels darken the picture behind
//! them, so white text is legible on any picture.

mod canvas;
mod glyphs;
mod ticks;

pub(super) use canvas::Canvas;

use crate::LegendPlace;
use crate::display::encoded;
use organza_scene::{ColorScale, MapScale, ScaleNumbers};
use splat_core::{LayerData, Layers};
use std::ops::Range;
use ticks::{Ticks, whole};

/// Height of a capital letter over the shorter side of the picture, and the least that can be read, pixels.
const CAPITAL: f64 = 0.021;
const LEAST_CAPITAL: f64 = 7.0;
/// From one line of text to the next, in capitals; so are all lengths below.
const LINE: f64 = 1.9;
/// Between the border of a panel and what is in it.
const PAD: f64 = 0.9;
/// Width of a bar, and side of the square of a whole number.
const BAR: f64 = 1.5;
/// Length of a tick, and from it to its number.
const TICK: f64 = 0.5;
/// Least height of a bar.
const LEAST_BAR: f64 = 6.0;
/// Greatest height of a panel over that of the picture, and greatest width over its width: the middle stays free.
const HIGHEST: f64 = 0.62;
const WIDEST: f64 = 0.3;
/// Greatest width of a panel beside the picture over the picture's height. Its height may be that of the picture, as it covers nothing.
const WIDEST_BESIDE: f64 = 0.6;
/// Text beside the colour of what has no number.
const NO_NUMBER: &str = "no number";
/// Most whole numbers of one panel.
const MOST_ROWS: usize = 24;

/// sRGB of texts and ticks, of panels, and how much a panel hides.
const TEXT: [f32; 3] = [1.0; 3];
const PANEL: [f32; 3] = [0.06; 3];
const PANEL_OPACITY: f32 = 0.66;

/// A panel, before its place is known.
struct Panel<'a> {
    title: String,
    scale: &'a ColorScale,
    content: Content,
    /// Pixels.
    width: f64,
    height: f64,
}

/// The content of a panel below its title.
enum Content {
    /// A bar of this height, pixels, with its ticks; the numbers at its ends come first.
    Bar(f64, Vec<(f64, String)>),
    /// Squares of a colour with what it stands for; one without a colour says how many there are besides.
    Rows(Vec<(Option<[f32; 3]>, String)>),
}

/// Panels above each other, as many as there is room for.
struct Panels<'a> {
    panels: Vec<Panel<'a>>,
    /// Height of a capital letter, which is also the distance between panels and to the border, pixels.
    capital: f64,
}

impl<'a> Panels<'a> {
    /// Panels for a picture of this size. Beside the picture they follow from its height alone.
    fn new(size: [u32; 2], scales: &'a [ColorScale], place: LegendPlace) -> Self {
        let [width, height] = size.map(f64::from);
        let (shorter, widest, highest) = match place {
            LegendPlace::Over => (width.min(height), WIDEST * width, HIGHEST * height),
            LegendPlace::Beside => (height, WIDEST_BESIDE * height, height),
        };
        let capital = (CAPITAL * shorter).max(LEAST_CAPITAL);
        // As many as there is room for, all alike.
        let panels = (1..=scales.len()).rev().find_map(|count| {
            let share = ((height - capital) / count as f64 - capital).min(highest);
            let panel = |scale| panel(scale, title(scale, scales), capital, [widest, share]);
            scales[..count].iter().map(panel).collect::<Option<Vec<_>>>()
        });
        Self { panels: panels.unwrap_or_default(), capital }
    }

    /// Width of a strip that holds the panels, pixels; 0 without panels.
    fn strip(&self) -> usize {
        let widest = self.panels.iter().map(|panel| panel.width).fold(0.0, f64::max);
        if self.panels.is_empty() { 0 } else { (widest + 2.0 * self.capital).ceil() as usize }
    }
}

/// Counts of legends and letters that a picture fails to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Lacking {
    /// Legends that have no room.
    pub(super) without_room: u64,
    /// Letters that are drawn as boxes.
    pub(super) boxes: u64,
}

/// Draws legends at the right border, the first at the top. A canvas for legends beside a picture has the
/// strip of [`with_strip`] already.
pub(super) fn draw(canvas: &mut Canvas<'_>, scales: &[ColorScale], place: LegendPlace) -> Lacking {
    let [width, height] = canvas.size();
    let Panels { panels, capital: margin } = Panels::new([width, height], scales, place);
    let stacked: f64 = panels.iter().map(|panel| panel.height + margin).sum();
    let mut top = (0.5 * (f64::from(height) - stacked + margin)).round();
    for panel in &panels {
        panel.draw(canvas, f64::from(width) - margin - panel.width, top, margin);
        top += panel.height + margin;
    }
    let boxes = panels.iter().flat_map(Panel::texts).flat_map(str::chars).filter(|letter| !glyphs::is_known(*letter));
    Lacking { without_room: (scales.len() - panels.len()) as u64, boxes: boxes.count() as u64 }
}

/// The layers of a displayed picture with an empty strip to the right, in which [`draw`] puts legends.
pub(super) fn with_strip(layers: &Layers, scales: &[ColorScale]) -> Layers {
    let [width, height] = layers.size;
    let strip = Panels::new(layers.size, scales, LegendPlace::Beside).strip();
    let mut wider = Layers { size: [width + strip as u32, height], ..Layers::default() };
    for (name, data) in &layers.images {
        let data = match data {
            LayerData::Rgb(pixels) => LayerData::Rgb(widened(pixels, width, strip)),
            LayerData::Scalar(values) => LayerData::Scalar(widened(values, width, strip)),
            LayerData::Id(_) => continue,
        };
        wider.insert(name, data);
    }
    wider
}

/// Rows with so many zeros at their ends.
fn widened<T: Copy + Default>(pixels: &[T], width: u32, strip: usize) -> Vec<T> {
    let row = |row: &[T]| [row, &vec![T::default(); strip]].concat();
    pixels.chunks(width.max(1) as usize).flat_map(row).collect()
}

/// Returns the title of a scale: its column, with its object if several scales have that column.
fn title(scale: &ColorScale, scales: &[ColorScale]) -> String {
    let Some(column) = &scale.column else { return scale.object.clone() };
    let is_alone = scales.iter().filter(|other| other.column.as_ref() == Some(column)).count() < 2;
    if is_alone { column.clone() } else { format!("{}: {column}", scale.object) }
}

/// The panel of a scale within a width and a height, if it can be that small.
fn panel(scale: &ColorScale, title: String, capital: f64, room: [f64; 2]) -> Option<Panel<'_>> {
    let text = |text: &str| glyphs::width(text) * capital / glyphs::CAPITAL;
    let around = (2.0 * PAD + LINE) * capital;
    let most = room[0] - 2.0 * PAD * capital;
    let left = room[1] - around;
    let (content, height) = match &scale.numbers {
        ScaleNumbers::Range(range) => {
            // Half of a number above the bar, and half of one below.
            let below = if scale.gap.is_some() { 2.0 * LINE * capital } else { 0.0 };
            let bar = (left - capital - below).floor();
            (bar >= LEAST_BAR * capital).then_some(())?;
            (Content::Bar(bar, told(scale.spacing(), *range, bar, capital)), bar + capital + below)
        }
        ScaleNumbers::Each(numbers) => {
            let gap_rows = usize::from(scale.gap.is_some());
            let rows = ((left / (LINE * capital)) as usize).min(MOST_ROWS).saturating_sub(gap_rows);
            let beside = most - (BAR + 2.0 * TICK) * capital;
            let whole = rows_of(scale, numbers, rows)?.into_iter();
            let shown = whole.map(|(color, label)| (color, shortened(label, |label| text(label) <= beside)));
            let content = Content::Rows(shown.collect());
            (content, ((numbers.len().min(rows) + gap_rows) as f64 - 1.0) * LINE * capital + BAR * capital)
        }
    };
    let labels: f64 = match &content {
        Content::Bar(_, told) => {
            let gap = scale.gap.map_or(0.0, |_| text(NO_NUMBER));
            let numbers = told.iter().map(|(_, label)| text(label)).fold(0.0, f64::max);
            (numbers + minus_space(told) * capital).max(gap)
        }
        Content::Rows(rows) => rows.iter().map(|(_, label)| text(label)).fold(0.0, f64::max),
    };
    let inner = (BAR + 2.0 * TICK) * capital + labels;
    let title = shortened(title, |title| text(title) <= most.max(inner));
    let width = (inner.max(text(&title)) + 2.0 * PAD * capital).ceil();
    (inner <= most).then_some(Panel { title, scale, content, width, height: (height + around).ceil() })
}

/// The space between ticks and numbers, in capitals, that keeps a tick and a minus apart.
fn minus_space(told: &[(f64, String)]) -> f64 {
    if told.iter().any(|(number, _)| *number < 0.0) { TICK } else { 0.0 }
}

/// The numbers beside a bar: its ends, and round ones that are not too near to them.
fn told(spacing: MapScale, range: [f64; 2], bar: f64, capital: f64) -> Vec<(f64, String)> {
    let [low, high] = range;
    let most = (bar / (2.0 * LINE * capital)) as usize;
    let Ticks { ends, round } = match spacing {
        MapScale::Linear => Ticks::new(range, most),
        MapScale::Logarithmic => Ticks::of_powers(range, most),
    };
    let near = LINE * capital / bar;
    let is_apart = |(number, _): &(f64, String)| (near..=1.0 - near).contains(&spacing.place(*number, range));
    let ends = if low < high { ends.to_vec() } else { ends[..1].to_vec() };
    ends.into_iter().chain(round.into_iter().filter(is_apart)).collect()
}

/// The rows of whole numbers, of which the last says how many there is no room for.
fn rows_of(scale: &ColorScale, numbers: &[f64], rows: usize) -> Option<Vec<(Option<[f32; 3]>, String)>> {
    let name = |number: &f64| {
        let meaning = scale.meaning(*number).map_or_else(String::new, |meaning| format!(" {meaning}"));
        (Some(scale.color(*number)), whole(*number) + &meaning)
    };
    let gap = scale.gap.map(|color| (Some(color), NO_NUMBER.to_owned()));
    if numbers.len() <= rows {
        return Some(numbers.iter().map(name).chain(gap).collect());
    }
    let shown = rows.checked_sub(1).filter(|shown| *shown > 0)?;
    let rest = (None, format!("and {} more", numbers.len() - shown));
    Some(numbers[..shown].iter().map(name).chain([rest]).chain(gap).collect())
}

/// A text, or as much of its beginning as fits.
fn shortened(text: String, fits: impl Fn(&str) -> bool) -> String {
    if fits(&text) {
        return text;
    }
    let mut beginning: Vec<char> = text.chars().collect();
    while beginning.pop().is_some() {
        let shown: String = beginning.iter().chain(&['.'; 3]).collect();
        if fits(&shown) {
            return shown;
        }
    }
    String::new()
}

impl Panel<'_> {
    /// All that is written on it.
    fn texts(&self) -> Vec<&str> {
        let mut texts = vec![self.title.as_str()];
        match &self.content {
            Content::Bar(_, ticks) => texts.extend(ticks.iter().map(|(_, text)| text.as_str())),
            Content::Rows(rows) => texts.extend(rows.iter().map(|(_, text)| text.as_str())),
        }
        texts
    }

    /// Draws it with its upper left corner at a place.
    fn draw(&self, canvas: &mut Canvas<'_>, left: f64, top: f64, capital: f64) {
        canvas.fill(pixels(left, self.width), pixels(top, self.height), PANEL, PANEL_OPACITY);
        let x = left + PAD * capital;
        let below = top + (PAD + LINE) * capital;
        let text = |canvas: &mut Canvas<'_>, at: [f64; 2], text: &str| canvas.text(text, at, capital, TEXT);
        text(canvas, [x, top + (PAD + 1.0) * capital], &self.title);
        let bar = pixels(x, BAR * capital);
        let labels = x + (BAR + 2.0 * TICK) * capital;
        let range = match self.scale.numbers {
            ScaleNumbers::Range(range) => range,
            ScaleNumbers::Each(_) => [0.0; 2],
        };
        let spacing = self.scale.spacing();
        match &self.content {
            Content::Bar(height, told) => {
                let first = (below + 0.5 * capital).round();
                let labels = labels + minus_space(told) * capital;
                for row in 0..*height as i64 {
                    let share = 1.0 - (row as f64 + 0.5) / height;
                    canvas.fill(
                        bar.clone(),
                        pixels(first + row as f64, 1.0),
                        self.scale.color(spacing.number(share, range)).map(encoded),
                        1.0,
                    );
                }
                for (number, label) in told {
                    let y = first + (1.0 - spacing.place(*number, range)) * height;
                    let tick = pixels(x + BAR * capital, TICK * capital);
                    canvas.fill(tick, pixels((y - 0.5).round(), (0.1 * capital).max(1.0)), TEXT, 1.0);
                    text(canvas, [labels, y + 0.5 * capital], label);
                }
                if let Some(color) = self.scale.gap {
                    let y = first + height + LINE * capital;
                    canvas.fill(bar, pixels(y, BAR * capital), color.map(encoded), 1.0);
                    text(canvas, [labels, y + 0.5 * (BAR + 1.0) * capital], NO_NUMBER);
                }
            }
            Content::Rows(rows) => {
                for (i, (color, label)) in rows.iter().enumerate() {
                    let y = below + i as f64 * LINE * capital;
                    if let Some(color) = color {
                        canvas.fill(bar.clone(), pixels(y, BAR * capital), color.map(encoded), 1.0);
                    }
                    text(canvas, [labels - TICK * capital, y + 0.5 * (BAR + 1.0) * capital], label);
                }
            }
        }
    }
}

/// The pixels from a place on, so many.
fn pixels(from: f64, length: f64) -> Range<i64> {
    let first = from.round() as i64;
    first..first + length.round().max(1.0) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use organza_scene::{ColorMap, PointColors};

    fn survey_scale(column: Option<&str>, colors: PointColors, numbers: ScaleNumbers) -> ColorScale {
        ColorScale { object: "survey".into(), column: column.map(str::to_owned), colors, numbers, gap: None }
    }

    fn heights() -> ColorScale {
        let map = PointColors::map(ColorMap::VIRIDIS);
        survey_scale(Some("height"), map, ScaleNumbers::Range([405.0, 513.0]))
    }

    /// A picture of one brightness with legends: its samples, and how many had no room.
    fn drawn(size: [usize; 2], brightness: f32, scales: &[ColorScale]) -> (Vec<[f32; 3]>, u64) {
        let [width, height] = size;
        let mut samples = vec![brightness; 3 * width * height];
        let left = draw(&mut Canvas::new(&mut samples, width as u32, 3), scales, LegendPlace::Over);
        (samples.as_chunks::<3>().0.to_vec(), left.without_room)
    }

    fn count(picture: &[[f32; 3]], is: impl Fn(&[f32; 3]) -> bool) -> usize {
        picture.iter().filter(|pixel| is(pixel)).count()
    }

    #[test]
    fn letters_without_a_form_are_counted() {
        let of_title = |title: &str| {
            let scale = ColorScale { column: Some(title.to_owned()), ..heights() };
            let mut samples = vec![0.5; 3 * 640 * 480];
            draw(&mut Canvas::new(&mut samples, 640, 3), &[scale], LegendPlace::Over)
        };
        assert_eq!(of_title("Größe, Δp → 3 µm² é"), Lacking { without_room: 0, boxes: 0 });
        assert_eq!(of_title("名前 a"), Lacking { without_room: 0, boxes: 2 });
    }

    #[test]
    fn a_bar_has_every_colour_of_the_map_from_below_upwards_and_leaves_the_middle_alone() {
        let (picture, left) = drawn([960, 540], 0.5, &[heights()]);
        assert_eq!(left, 0);
        let place = |color: [f32; 3]| {
            let near = |pixel: &[f32; 3]| pixel.iter().zip(color).all(|(a, b)| (a - encoded(b)).abs() < 0.02);
            picture.iter().position(near).expect("a colour of the map") / 960
        };
        let rows = [1.0, 0.75, 0.5, 0.25, 0.0].map(|share| place(ColorMap::VIRIDIS.at(share)));
        assert!(rows.windows(2).all(|pair| pair[0] < pair[1]), "{rows:?}");
        let columns = (0..960).filter(|x| picture.iter().skip(*x).step_by(960).any(|p| *p != [0.5; 3]));
        assert!(columns.min() > Some(960 * 2 / 3));
    }

    #[test]
    fn texts_are_legible_on_black_and_on_white() {
        for brightness in [0.0, 1.0] {
            let (picture, _) = drawn([480, 270], brightness, &[heights()]);
            let panel = PANEL[0] * PANEL_OPACITY + brightness * (1.0 - PANEL_OPACITY);
            let [text, behind] = [1.0, panel].map(|x| 0.05 + f32::powf(x, 2.2));
            assert!(text / behind > 4.5, "{brightness}: {}", text / behind);
            let is = |color: f32| move |pixel: &[f32; 3]| pixel.iter().all(|c| (c - color).abs() < 0.05);
            assert!(count(&picture, is(panel)) > 1000, "{brightness}");
            assert!(brightness == 1.0 || count(&picture, is(1.0)) > 100, "{}", count(&picture, is(1.0)));
        }
    }

    #[test]
    fn a_picture_of_twice_the_size_has_a_legend_of_twice_the_size() {
        let area = |scale: usize| {
            let (picture, _) = drawn([960 * scale, 540 * scale], 0.5, &[heights()]);
            count(&picture, |pixel| *pixel != [0.5; 3]) as f64
        };
        let ratio = area(2) / area(1);
        assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
    }

    #[test]
    fn what_has_no_room_is_counted_and_the_others_stand_above_each_other() {
        let scales = vec![heights(); 40];
        let (_, left) = drawn([960, 540], 0.5, &scales);
        assert!((30..40).contains(&left), "{left}");
        assert_eq!(drawn([960, 540], 0.5, &scales[..3]).1, 0);
        assert_eq!(drawn([40, 30], 0.5, &scales[..1]).1, 1);
        assert_eq!(drawn([960, 540], 0.5, &[]), (vec![[0.5; 3]; 960 * 540], 0));
    }

    #[test]
    fn a_legend_beside_a_picture_covers_none_of_it_and_is_there_where_over_it_there_is_no_room() {
        let long = survey_scale(
            Some("temperature of the outer wall"),
            PointColors::Distinct,
            ScaleNumbers::Range([-273.15, 1e4]),
        );
        for size in [[320_u32, 240], [64, 240], [960, 540]] {
            for scales in [vec![heights()], vec![heights(), long.clone()]] {
                let count = (size[0] * size[1]) as usize;
                let mut layers = Layers { size, ..Layers::default() };
                layers.insert("beauty", LayerData::Rgb(vec![[1.0; 3]; count]));
                layers.insert("alpha", LayerData::Scalar(vec![1.0; count]));
                let wider = with_strip(&layers, &scales);
                let mut samples = wider.rgb("beauty").expect("a layer").as_flattened().to_vec();
                assert_eq!(
                    draw(&mut Canvas::new(&mut samples, wider.size[0], 3), &scales, LegendPlace::Beside),
                    Lacking { without_room: 0, boxes: 0 },
                    "{size:?}"
                );
                assert_eq!(
                    (wider.size[1], wider.scalar("alpha").expect("a layer").len()),
                    (size[1], samples.len() / 3)
                );
                let strip = (wider.size[0] - size[0]) as usize;
                assert!(strip > 20 && strip < size[1] as usize, "{strip} for {size:?}");
                let rows = samples.chunks(3 * wider.size[0] as usize);
                let (picture, legend): (Vec<_>, Vec<_>) = rows.map(|row| row.split_at(3 * size[0] as usize)).unzip();
                assert!(picture.concat().iter().all(|sample| *sample == 1.0), "the picture is covered");
                assert!(legend.concat().iter().filter(|sample| **sample > 0.9).count() > 100, "no text");
                assert!(legend.iter().all(|row| row[..3].iter().all(|sample| *sample == 0.0)), "no margin");
            }
        }
        let layers = Layers { size: [8, 8], ..Layers::default() };
        assert_eq!(with_strip(&layers, &[]).size, [8, 8]);
    }

    #[test]
    fn whole_numbers_have_a_row_each_with_what_they_mean() {
        let numbers: Vec<f64> = (0..64).map(f64::from).collect();
        let scale = survey_scale(Some("class"), PointColors::Classes, ScaleNumbers::Each(numbers.clone()));
        let rows = rows_of(&scale, &numbers, 5).expect("room for rows");
        assert_eq!(rows[2], (Some(scale.color(2.0)), "2 ground".to_owned()));
        assert_eq!(rows[4], (None, "and 60 more".to_owned()));
        assert_eq!(rows_of(&scale, &numbers[..3], 5).map(|rows| rows.len()), Some(3));
        assert_eq!(rows_of(&scale, &numbers, 1), None);
        let with_gap = ColorScale { gap: Some([0.5; 3]), ..scale.clone() };
        let rows = rows_of(&with_gap, &numbers, 5).expect("room for rows");
        assert_eq!(rows[5], (Some([0.5; 3]), "no number".to_owned()));
        assert_eq!([drawn([480, 270], 0.5, &[scale]).1, drawn([480, 270], 0.5, &[with_gap]).1], [0, 0]);
    }

    #[test]
    fn a_bar_shows_the_colour_of_no_number_below_it() {
        let gap = [0.0, 0.0, 1.0];
        let (picture, left) = drawn([960, 540], 0.5, &[ColorScale { gap: Some(gap), ..heights() }]);
        let (plain, _) = drawn([960, 540], 0.5, &[heights()]);
        let is_blue = |pixel: &&[f32; 3]| pixel[2] > 0.999 && pixel[0] < 0.001;
        let blue = |picture: &[[f32; 3]]| picture.iter().filter(is_blue).count();
        assert_eq!((left, blue(&plain)), (0, 0));
        // A square of a bar's width: 17 pixels a side.
        assert_eq!(blue(&picture), 17 * 17);
    }

    #[test]
    fn names_tell_objects_apart_where_columns_do_not_and_long_ones_are_shortened() {
        let other = ColorScale { object: "scan".into(), ..heights() };
        let volume = survey_scale(None, PointColors::Distinct, ScaleNumbers::Range([0.0, 1.0]));
        let scales = [heights(), other, volume];
        assert_eq!(scales.each_ref().map(|s| title(s, &scales)), ["survey: height", "scan: height", "survey"]);
        assert_eq!(title(&scales[0], &scales[..1]), "height");
        assert_eq!(shortened("a long name".into(), |text| text.len() < 9), "a lon...");
        assert_eq!(drawn([480, 270], 0.5, &[ColorScale { column: Some("w".repeat(256)), ..heights() }]).1, 0);
    }

    #[test]
    fn a_column_of_one_number_has_one_tick() {
        assert_eq!(told(MapScale::Linear, [4.0, 4.0], 100.0, 8.0), [(4.0, "4".to_owned())]);
        let told_of =
            |spacing, range| told(spacing, range, 200.0, 10.0).into_iter().map(|tick| tick.1).collect::<Vec<_>>();
        assert_eq!(told_of(MapScale::Linear, [0.0, 100.0]), ["0", "100", "20", "40", "60", "80"]);
        assert_eq!(told_of(MapScale::Logarithmic, [0.02, 300.0]), ["0.02", "300", "0.1", "1", "10", "100"]);
        assert_eq!(told_of(MapScale::Logarithmic, [1.0, 10.0]), ["1", "10", "2", "5"]);
    }
}
