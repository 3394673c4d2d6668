//! Colour maps, each by ten or fewer colours at equal distances, between which colours are blended.
//!
//! viridis, magma, inferno and plasma are those of matplotlib (Smith, van der Walt and Firing, CC0), cividis is that of Nuñez,
//! Anderton and Renslow 2018, turbo that of Mikhailov 2019, coolwarm that of Moreland 2009 (Diverging Color Maps for Scientific Visualization).

use splat_core::srgb::linear_from_hex;

/// Colours as bytes of sRGB, from the lowest value to the highest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ColorMap(&'static [u32]);

const VIRIDIS: ColorMap =
    ColorMap(&[0x440154, 0x482878, 0x3e4a89, 0x31688e, 0x26828e, 0x1f9e89, 0x35b779, 0x6dcd59, 0xb4de2c, 0xfde725]);
const MAGMA: ColorMap =
    ColorMap(&[0x000004, 0x180f3e, 0x451077, 0x721f81, 0x9f2f7f, 0xcd4071, 0xf1605d, 0xfd9567, 0xfec98d, 0xfcfdbf]);
const INFERNO: ColorMap =
    ColorMap(&[0x000004, 0x1b0c42, 0x4b0c6b, 0x781c6d, 0xa52c60, 0xcf4446, 0xed6925, 0xfb9a06, 0xf7d03c, 0xfcffa4]);
const PLASMA: ColorMap =
    ColorMap(&[0x0d0887, 0x47039f, 0x7301a8, 0x9c179e, 0xbd3786, 0xd8576b, 0xed7953, 0xfa9e3b, 0xfdc926, 0xf0f921]);
const CIVIDIS: ColorMap =
    ColorMap(&[0x00204d, 0x00336f, 0x39486b, 0x575c6d, 0x707173, 0x8a8779, 0xa69d75, 0xc4b56c, 0xe4cf5b, 0xffea46]);
const TURBO: ColorMap =
    ColorMap(&[0x30123b, 0x4662d7, 0x36aaf9, 0x1ae4b6, 0x72fe5e, 0xc8ef34, 0xfaba39, 0xf66b19, 0xcb2a04, 0x7a0403]);
const GREY: ColorMap = ColorMap(&[0x202020, 0xf4f4f4]);

const COOLWARM: ColorMap =
    ColorMap(&[0x3b4cc0, 0x6282ea, 0x8db0fe, 0xb8d0f9, 0xdddddd, 0xf5c4ad, 0xf49a7b, 0xde604d, 0xb40426]);

/// The maps, by the names that scenes and commands have for them.
const NAMED: [(&str, ColorMap); 8] = [
    ("viridis", VIRIDIS),
    ("magma", MAGMA),
    ("inferno", INFERNO),
    ("plasma", PLASMA),
    ("cividis", CIVIDIS),
    ("turbo", TURBO),
    ("grey", GREY),
    ("coolwarm", COOLWARM),
];

impl ColorMap {
    /// The default map: uniform also for red-green colour blindness, and increasing in brightness.
    pub const VIRIDIS: Self = VIRIDIS;
    /// The whole rainbow, with the most distinguishable steps.
    pub const TURBO: Self = TURBO;
    /// From blue via grey to red: the map of numbers with both signs, with 0 in its middle.
    pub const COOLWARM: Self = COOLWARM;

    /// The map of a name; `None` for an unknown name.
    pub fn named(name: &str) -> Option<Self> {
        NAMED.iter().find(|(known, _)| *known == name).map(|(_, map)| *map)
    }

    /// Names of all maps.
    pub fn names() -> impl Iterator<Item = &'static str> {
        NAMED.iter().map(|(name, _)| *name)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        NAMED.iter().find(|(_, map)| *map == self).map_or("colours", |(name, _)| name)
    }

    /// Linear Rec.709 at a place from 0 to 1; places outside have the colour of the nearest end.
    ///
    /// ```
    /// let turbo = convert::ColorMap::named("turbo").unwrap();
    /// assert_eq!(turbo.at(1.0), turbo.at(9.0));
    /// ```
    pub fn at(self, place: f64) -> [f32; 3] {
        let last = self.0.len() - 1;
        let place = place.clamp(0.0, 1.0) * last as f64;
        let below = (place as usize).min(last - 1);
        let part = (place - below as f64) as f32;
        let [a, b] = [below, below + 1].map(|i| linear_from_hex(self.0[i]));
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * part)
    }

    /// Whether it has a middle that both ends lead away from: of numbers with both signs that is where 0 belongs.
    pub fn is_diverging(self) -> bool {
        self == COOLWARM
    }

    /// The number of its colours, between which others are blended.
    pub fn steps(self) -> usize {
        self.0.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middles_are_the_colours_of_the_map() {
        assert_eq!(VIRIDIS.at(0.0), linear_from_hex(0x440154));
        assert_eq!(VIRIDIS.at(1.0), linear_from_hex(0xfde725));
        assert_eq!(VIRIDIS.at(7.0), VIRIDIS.at(1.0));
        let [a, b] = [linear_from_hex(0x202020)[0], linear_from_hex(0xf4f4f4)[0]];
        assert!((GREY.at(0.25)[1] - (0.75 * a + 0.25 * b)).abs() < 1e-6);
    }

    #[test]
    fn a_diverging_map_is_brightest_in_its_middle() {
        let sum = |place: f64| COOLWARM.at(place).iter().sum::<f32>();
        assert!(COOLWARM.is_diverging() && !TURBO.is_diverging());
        assert!((0..100).all(|i| sum(f64::from(i) / 100.0) <= sum(0.5)));
    }

    #[test]
    fn every_map_is_found_by_its_name() {
        assert!(ColorMap::names().all(|name| ColorMap::named(name).map(ColorMap::name) == Some(name)));
        assert_eq!(ColorMap::named("jet"), None);
    }

    #[test]
    fn maps_for_measures_grow_brighter_all_along() {
        let luminance = |c: [f32; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        for map in [VIRIDIS, MAGMA, INFERNO, PLASMA, CIVIDIS, GREY] {
            let luminances: Vec<f32> = (0..=90).map(|i| luminance(map.at(f64::from(i) / 90.0))).collect();
            assert!(luminances.windows(2).all(|w| w[1] > w[0]), "{map:?}");
        }
    }
}
