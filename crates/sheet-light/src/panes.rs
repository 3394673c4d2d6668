//! Translucent polygons among slabs across the view. Their light comes through shadows that are known before, so what each shows is, too; a pixel that
//! shows some has what its slabs hold before, among and behind them, one after the other.

use crate::fold::Sheeted;
use crate::half::{EyePanes, Lamps, PanesInTheOpen, Polygons};
use crate::picture::{Fragments, Picture};
use crate::tile::TILE;
use crate::{Aligned, Error};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::ChannelLayout;
use splat_core::{Camera, Progress};
use std::ops::Range;

/// Translucent polygons that pixels show, lit.
pub(crate) struct Panes<'a> {
    of: EyePanes<'a>,
    camera: &'a Camera,
    /// Channels of each place, one place after the other.
    values: Vec<f32>,
    channels: usize,
    /// View depth of the first slab.
    origin: f64,
}

/// Of a tile, those that are not composited yet.
pub(crate) struct Waiting {
    /// Ranks, by pixel without the rim.
    ranks: Vec<Range<u32>>,
    /// Depth of the nearest of each row, counted from the first slab.
    nearest: [f32; TILE],
}

impl<'a> Sheeted<'a> {
    /// With translucent polygons, lit as the volumes are; opaque ones are left out, for they belong to what hides things: `opaque` has view depths of
    /// that at each pixel, or nothing. One tick a band of rows.
    ///
    /// # Errors
    /// [`Error::Polygons`], [`Error::Parameter`] along a lattice, [`Error::Limit`] where lists of them take too much, or [`Error::Cancelled`].
    pub fn with_polygons(
        mut self,
        polygons: &[Polygons<'a>],
        opaque: &[f32],
        layout: &ChannelLayout,
        progress: Option<&Progress>,
    ) -> Result<Self, Error> {
        polygons.iter().enumerate().try_for_each(|(index, polygons)| polygons.check(index))?;
        let panes: Vec<Polygons<'a>> = polygons.iter().filter(|p| !p.is_opaque()).copied().collect();
        if panes.is_empty() {
            return Ok(self);
        }
        if self.params.aligned == Aligned::Axis {
            let expected = "slabs across the view, or one volume and nothing beside it";
            return Err(Error::parameter("aligned", "along a lattice beside polygons", expected));
        }
        let quiet = Progress::new();
        let input = &self.input;
        let most = self.params.limits.max_bytes.saturating_sub(self.bytes());
        let of = EyePanes::new(panes, (input.camera, opaque), (most, layout), progress.unwrap_or(&quiet))?;
        let ambient = input.ambient;
        let camera = input.camera;
        let lamps = Lamps { carried: None, mapped: &input.lights, ambient, camera, light_alone: false };
        let mut shown = PanesInTheOpen::new(&of, layout);
        shown.shade(camera, None, &lamps, input.shadow_origin);
        let values = shown.into_values();
        self.panes = Some(Panes { of, camera, values, channels: layout.count(), origin: self.slabs.origin });
        Ok(self)
    }
}

impl Panes<'_> {
    /// Bytes of the lists.
    pub(crate) fn bytes(&self) -> u64 {
        self.of.bytes() + 4 * self.values.len() as u64
    }

    /// Depth of a place, counted from the first slab.
    fn depth(&self, rank: u32) -> f32 {
        (f64::from(self.of.seen.depth(rank as usize)) - self.origin) as f32
    }
}

impl Waiting {
    pub(crate) fn new() -> Self {
        Self { ranks: vec![0..0; TILE * TILE], nearest: [f32::INFINITY; TILE] }
    }

    /// Takes up those of the tile at `corner` in a range of view depths. Whether there are any.
    pub(crate) fn begin(&mut self, of: Option<&Panes<'_>>, corner: [usize; 2], range: &Range<f64>) -> bool {
        self.ranks.fill(0..0);
        self.nearest = [f32::INFINITY; TILE];
        let Some(of) = of else { return false };
        let [width, height] = of.camera.size.map(|s| s as usize);
        for y in 0..TILE.min(height - corner[1]) {
            for x in 0..TILE.min(width - corner[0]) {
                let all = of.of.of_pixel((corner[1] + y) * width + corner[0] + x);
                let before = |end: f64| {
                    let is_before = |rank: &u32| f64::from(of.of.seen.depth(*rank as usize)) < end;
                    all.start + all.clone().take_while(is_before).count() as u32
                };
                self.ranks[y * TILE + x] = before(range.start)..before(range.end);
            }
            self.find_nearest(of, y);
        }
        self.nearest.iter().any(|depth| *depth < f32::INFINITY)
    }

    fn find_nearest(&mut self, of: &Panes<'_>, y: usize) {
        let first = |ranks: &Range<u32>| if ranks.is_empty() { f32::INFINITY } else { of.depth(ranks.start) };
        self.nearest[y] = self.ranks[y * TILE..(y + 1) * TILE].iter().map(first).fold(f32::INFINITY, f32::min);
    }

    /// Most of any of the pixels from (x, y) on that lie before a depth.
    #[inline(always)]
    pub(crate) fn most<S: Simd>(&self, of: Option<&Panes<'_>>, [x, y]: [usize; 2], depth: f32) -> usize {
        let Some(of) = of.filter(|_| self.nearest[y] < depth) else { return 0 };
        let lanes = &self.ranks[y * TILE + x..][..Lanes::<S>::COUNT];
        let before = |ranks: &Range<u32>| ranks.clone().take_while(|rank| of.depth(*rank) < depth).count();
        lanes.iter().map(before).max().unwrap_or(0)
    }

    /// Depth of the `n`-th of a pixel, if it lies before `end`; counted from the first slab.
    #[inline(always)]
    fn depth(&self, of: &Panes<'_>, pixel: usize, n: usize, end: f32) -> Option<f32> {
        let rank = self.ranks[pixel].clone().nth(n)?;
        Some(of.depth(rank)).filter(|depth| *depth < end)
    }

    /// Depths between which pixels from (x, y) on have the part that lies behind n − 1 of theirs and before the n-th, of those before `end`; without
    /// any length where they have fewer.
    #[inline(always)]
    pub(crate) fn part<S: Simd>(
        &self,
        of: &Panes<'_>,
        [x, y]: [usize; 2],
        n: usize,
        end: f32,
    ) -> [[f32; MAX_LANES]; 2] {
        let mut part = [[f32::NEG_INFINITY; MAX_LANES], [f32::INFINITY; MAX_LANES]];
        for lane in 0..Lanes::<S>::COUNT {
            let at = |n: usize| self.depth(of, y * TILE + x + lane, n, end);
            if let Some(n) = n.checked_sub(1) {
                part[0][lane] = at(n).unwrap_or(f32::INFINITY);
            }
            part[1][lane] = at(n).unwrap_or(f32::INFINITY);
        }
        part
    }

    /// Composites the `n`-th of the pixels from (x, y) on, of those before `end`.
    #[inline(always)]
    pub(crate) fn composite<S: Simd>(
        &self,
        simd: S,
        of: &Panes<'_>,
        ([x, y], n, end): ([usize; 2], usize, f32),
        (fragments, picture): (&mut Fragments, &mut Picture),
    ) {
        fragments.optical_depth = [[0.0; MAX_LANES]; 3];
        fragments.values[..of.channels].fill([0.0; MAX_LANES]);
        for lane in 0..Lanes::<S>::COUNT {
            let pixel = y * TILE + x + lane;
            let Some(depth) = self.depth(of, pixel, n, end) else { continue };
            let rank = self.ranks[pixel].start as usize + n;
            let tau = of.of.seen.seen(rank, of.camera).crossing();
            (0..3).for_each(|p| fragments.optical_depth[p][lane] = tau[p]);
            let values = &of.values[rank * of.channels..][..of.channels];
            values.iter().enumerate().for_each(|(c, value)| fragments.values[c][lane] = *value);
            (fragments.near[lane], fragments.far[lane]) = (depth, depth);
            fragments.object[lane] = of.of.seen.polygons(rank).object;
        }
        picture.composite(simd, y, x, fragments, of.origin);
    }

    /// Leaves those of a row behind that lie before a depth.
    pub(crate) fn pass(&mut self, of: &Panes<'_>, y: usize, depth: f32) {
        if self.nearest[y] >= depth {
            return;
        }
        for ranks in &mut self.ranks[y * TILE..(y + 1) * TILE] {
            ranks.start += ranks.clone().take_while(|rank| of.depth(*rank) < depth).count() as u32;
        }
        self.find_nearest(of, y);
    }

    /// Composites all that are left, behind everything else.
    #[inline(always)]
    pub(crate) fn finish<S: Simd>(
        &mut self,
        simd: S,
        of: Option<&Panes<'_>>,
        (fragments, picture): (&mut Fragments, &mut Picture),
    ) {
        let Some(of) = of else { return };
        for (y, x) in (0..TILE).flat_map(|y| (0..TILE).step_by(Lanes::<S>::COUNT).map(move |x| (y, x))) {
            for n in 0..self.most::<S>(Some(of), [x, y], f32::INFINITY) {
                self.composite(simd, of, ([x, y], n, f32::INFINITY), (fragments, picture));
            }
        }
    }
}
