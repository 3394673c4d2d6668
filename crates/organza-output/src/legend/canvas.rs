//! Rectangles and texts over a displayed picture.

use super::glyphs;
use std::ops::Range;

/// Half of the width of a pen over the height of a capital, and the least that shows at all, pixels.
const PEN: f64 = 0.062;
const LEAST_PEN: f64 = 0.62;

/// A picture in samples of sRGB from 0 to 1, with opacity that is not multiplied into them, or without.
pub(in super::super) struct Canvas<'a> {
    samples: &'a mut [f32],
    width: usize,
    /// Three, or four with opacity.
    channels: usize,
}

impl<'a> Canvas<'a> {
    /// A picture of this width.
    pub(in super::super) fn new(samples: &'a mut [f32], width: u32, channels: usize) -> Self {
        Self { samples, width: width as usize, channels }
    }

    /// Width and height, pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        let row = (self.width * self.channels).max(1);
        [self.width as u32, (self.samples.len() / row) as u32]
    }

    /// Lays a colour over some columns and rows.
    pub(super) fn fill(&mut self, columns: Range<i64>, rows: Range<i64>, color: [f32; 3], opacity: f32) {
        for y in rows {
            for x in columns.clone() {
                self.over(x, y, color, opacity);
            }
        }
    }

    /// Writes a text from a place on the line that it stands on.
    pub(super) fn text(&mut self, text: &str, origin: [f64; 2], capital: f64, color: [f32; 3]) {
        let [x, y] = origin;
        let unit = capital / glyphs::CAPITAL;
        let mut left = x;
        for character in text.chars() {
            let place = |[right, up]: [f64; 2]| [left + right * unit, y - up * unit];
            let lines: Vec<[[f64; 2]; 2]> = glyphs::lines(character).map(|line| line.map(place)).collect();
            self.strokes(&lines, (PEN * capital).max(LEAST_PEN), color);
            left += glyphs::advance(character) * unit;
        }
    }

    /// Draws lines with a round pen; where they meet it is as if there were one.
    fn strokes(&mut self, lines: &[[[f64; 2]; 2]], pen: f64, color: [f32; 3]) {
        let ends = || lines.iter().flatten();
        let reach = |axis: usize| {
            let low = ends().map(|p| p[axis]).fold(f64::INFINITY, f64::min) - pen - 1.0;
            let high = ends().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max) + pen + 1.0;
            low.floor() as i64..high.ceil() as i64
        };
        if lines.is_empty() {
            return;
        }
        for y in reach(1) {
            for x in reach(0) {
                let middle = [x as f64 + 0.5, y as f64 + 0.5];
                let nearest = lines.iter().map(|line| distance(*line, middle)).fold(f64::INFINITY, f64::min);
                // A pixel is a disc here whose edge the pen's crosses straight.
                self.over(x, y, color, (0.5 + pen - nearest).clamp(0.0, 1.0) as f32);
            }
        }
    }

    /// Porter and Duff's over, with opacities that are not multiplied into colours; outside the picture nothing.
    fn over(&mut self, x: i64, y: i64, color: [f32; 3], opacity: f32) {
        let [width, height] = self.size().map(i64::from);
        if opacity <= 0.0 || !(0..width).contains(&x) || !(0..height).contains(&y) {
            return;
        }
        let first = (y as usize * self.width + x as usize) * self.channels;
        let pixel = &mut self.samples[first..first + self.channels];
        let behind = pixel.get(3).map_or(1.0, |alpha| *alpha) * (1.0 - opacity);
        for (sample, color) in pixel.iter_mut().zip(color) {
            *sample = (color * opacity + *sample * behind) / (opacity + behind);
        }
        if let Some(alpha) = pixel.get_mut(3) {
            *alpha = opacity + behind;
        }
    }
}

/// From a line between two ends, which may be one place, to a place.
fn distance(line: [[f64; 2]; 2], place: [f64; 2]) -> f64 {
    let [from, to] = line;
    let along = [to[0] - from[0], to[1] - from[1]];
    let off = [place[0] - from[0], place[1] - from[1]];
    let squared = along[0] * along[0] + along[1] * along[1];
    let share = if squared > 0.0 { ((off[0] * along[0] + off[1] * along[1]) / squared).clamp(0.0, 1.0) } else { 0.0 };
    let [dx, dy] = [0, 1].map(|i| off[i] - share * along[i]);
    (dx * dx + dy * dy).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_laid_over_a_transparent_picture_has_its_own_colour_and_opacity() {
        let mut samples = vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5];
        Canvas::new(&mut samples, 2, 4).fill(0..2, 0..1, [0.25, 0.5, 1.0], 0.5);
        assert_eq!(samples[..4], [0.25, 0.5, 1.0, 0.5]);
        // Half of 0.5 stays of red, under half of the colour: 2/3 of 0.25 and 1/3 of 1.
        assert!((samples[4] - 0.5).abs() < 1e-6 && (samples[7] - 0.75).abs() < 1e-6, "{samples:?}");
    }

    #[test]
    fn a_line_covers_its_length_times_its_width_wherever_it_lies() {
        for shift in [0.0, 0.25, 0.6] {
            let mut samples = vec![0.0; 3 * 40 * 20];
            let line = [[8.0 + shift, 10.0 + shift], [30.0 + shift, 10.0 + shift]];
            Canvas::new(&mut samples, 40, 3).strokes(&[line], 2.0, [1.0; 3]);
            let area: f32 = samples.iter().step_by(3).sum();
            let expected = 22.0 * 4.0 + std::f32::consts::PI * 4.0;
            assert!((area - expected).abs() < 0.02 * expected, "{shift}: {area} {expected}");
        }
    }

    #[test]
    fn nothing_is_drawn_outside_of_the_picture() {
        let mut samples = vec![0.5; 3 * 4 * 4];
        let mut canvas = Canvas::new(&mut samples, 4, 3);
        canvas.fill(-9..0, -9..9, [1.0; 3], 1.0);
        canvas.text("M", [40.0, 2.0], 9.0, [1.0; 3]);
        assert!(samples.iter().all(|sample| *sample == 0.5));
    }
}
