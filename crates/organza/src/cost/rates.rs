//! Nanoseconds of one item on one core, and the share of its time that threads divide.

use super::{Count, CountedPass};
use crate::pass;
use crate::statistics::Conversion;

/// The machine on which the built-in figures were measured.
pub const BUILT_IN_MACHINE: &str = "AMD EPYC, one core, profile dev";

/// A kind of item that a pass handles. The time of a pass is the sum over its kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Item {
    /// A byte of a file that is read.
    FileByte,
    /// An object without a file, looked at on a coarse lattice.
    GeneratedObject,
    /// A splat that is converted.
    ConvertedSplat,
    /// A splat of the zero set of a field, which is found by evaluating it.
    FieldSplat,
    /// A raw point that becomes a disc: its neighbours tell how it lies.
    SurfacePoint,
    /// A raw point that becomes a medium: its neighbours tell its volume.
    MatterPoint,
    /// A splat that is offered to a shadow table.
    CastSplat,
    /// An opaque splat that is offered to a shadow table, where it ends rays.
    OpaqueCaster,
    /// An entry of a shadow table: a splat in a cell.
    ShadowEntry,
    /// A ray of a cell of a shadow table that samples a splat.
    ShadowRay,
    /// A splat that is culled and sorted.
    SortedSplat,
    /// A disc that is given to a group of discs that hardly overlap.
    GroupedDisc,
    /// The same where discs are enlarged until their group covers the surface.
    EnlargedDisc,
    /// A splat that gets its footprint.
    ProjectedSplat,
    /// A splat that gets its radiance.
    ShadedSplat,
    /// A look-up of one splat in one shadow table.
    ShadowLookUp,
    /// An opaque splat that is resolved by depth.
    OpaqueSplat,
    /// A fragment of an opaque splat.
    OpaqueFragment,
    /// A fragment of an opaque splat whose footprint is an image.
    ImageFragment,
    /// A fragment of an opaque disc that rays meet.
    MetFragment,
    /// A fragment of a translucent splat that is composited.
    BlendedFragment,
    /// A translucent splat that is composited.
    BlendedSplat,
    /// A sample of the accumulator, once for each range of depth.
    RangeSample,
    /// A particle of one set, of triangles, splats, or a box or ball of a medium.
    Particle,
    /// A particle of one set, in a cell of a volume.
    CellParticle,
    /// A particle of one set, where a line meets a field by a formula.
    FieldParticle,
    /// A particle of one set, where a line meets an isosurface in a cell, between its corners.
    LatticeParticle,
    /// A particle of one set, where a line meets an isosurface in a cell, by cubics.
    CubicParticle,
    /// A particle of one set, where a line meets a surface through scattered points.
    ScatteredParticle,
    /// A voxel that a sampler of particles looks at once.
    SurveyedVoxel,
    /// A cell that a sampler of particles searches for a surface through scattered points.
    SearchedCell,
    /// A sample of one set of particles.
    SetSample,
    /// A fragment of a voxel or splat in a slab.
    SheetFragment,
    /// A row of a footprint in one slab of a sweep, up to 16 samples of the eye's image or a light's.
    SweptRow,
    /// A sample of a light's image that is moved for a point of a light with a size, in one slab.
    SoftSample,
    /// A sample that shows in a slab, read between 8 voxels and classified; what takes longer counts several times.
    SlabSample,
    /// A sample of the eye's image or a light's that reads a volume in a slab across a half vector.
    MediumSample,
    /// A look of a point of a light for the polygons before a place: of a surface, or of a volume in a slab across a half vector.
    PolygonLook,
    /// A disc that is prepared for rays.
    SurfelDisc,
    /// A disc in the hierarchy of boxes that bent rays go through.
    BoxedDisc,
    /// A fragment of a disc in a layer.
    SurfelFragment,
    /// A sample of a picture of layers of discs.
    SurfelSample,
    /// A sample through which rays are mirrored and bent.
    BentSample,
    /// A fragment that is sorted in its pixel and composited in f64.
    ExactFragment,
    /// A sample that becomes part of a pixel.
    FinishedSample,
    /// A sample that looks up an environment.
    EnvironmentSample,
}

/// What the number of items goes with, where samples of a picture and sets of particles change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Growth {
    /// Neither.
    Fixed,
    /// Samples of the picture.
    Samples,
    /// Samples of the picture times sets of particles.
    Sets,
}

/// What is known of a kind of item.
struct Row {
    item: Item,
    /// Its name in files of a machine.
    name: &'static str,
    /// In sentences.
    words: &'static str,
    /// The pass that handles it.
    pass: &'static str,
    /// Nanoseconds of one core.
    ns: f64,
    /// Share of that time which threads divide, 0 to 1.
    parallel: f64,
}

const fn row(item: Item, name: &'static str, words: &'static str, pass: &'static str, ns: f64, parallel: f64) -> Row {
    Row { item, name, words, pass, ns, parallel }
}

/// The built-in figures, measured on [`BUILT_IN_MACHINE`] by the command in benches/README.md, in the order of [`Item`]. Enlarged and grouped discs
/// and exact fragments are of older benchmarks, points that become discs of a million normal points on one thread and on two; points that become a
/// medium, and parallel shares, are estimates. Those of drawing are fitted to pictures of `scenes/` that are 160 and 480 pixels wide.
static TABLE: [Row; 46] = [
    row(Item::FileByte, "file_byte", "bytes", pass::READ, 60.0, 0.0),
    row(Item::GeneratedObject, "generated_object", "objects", pass::READ, 1.5e7, 0.5),
    row(Item::ConvertedSplat, "converted_splat", "splats", pass::CONVERT, 350.0, 0.5),
    row(Item::FieldSplat, "field_splat", "splats of fields", pass::CONVERT, 4500.0, 0.9),
    row(Item::SurfacePoint, "surface_point", "points that become discs", pass::CONVERT, 2700.0, 0.7),
    row(Item::MatterPoint, "matter_point", "points that become a medium", pass::CONVERT, 5000.0, 0.95),
    row(Item::CastSplat, "cast_splat", "splats", pass::SHADOW_MAP, 60.0, 0.9),
    row(Item::OpaqueCaster, "opaque_caster", "opaque splats", pass::SHADOW_MAP, 490.0, 0.9),
    row(Item::ShadowEntry, "shadow_entry", "entries of a shadow table", pass::SHADOW_MAP, 60.0, 0.9),
    row(Item::ShadowRay, "shadow_ray", "rays of a shadow table", pass::SHADOW_MAP, 70.0, 0.9),
    row(Item::SortedSplat, "sorted_splat", "splats", pass::SORT, 27.0, 0.5),
    row(Item::GroupedDisc, "grouped_disc", "discs", pass::GROUP, 1e4, 0.5),
    row(Item::EnlargedDisc, "enlarged_disc", "enlarged discs", pass::GROUP, 1e6, 0.9),
    row(Item::ProjectedSplat, "projected_splat", "splats", pass::PROJECT, 70.0, 0.9),
    row(Item::ShadedSplat, "shaded_splat", "splats", pass::SHADE, 80.0, 0.9),
    row(Item::ShadowLookUp, "shadow_look_up", "look-ups in shadow tables", pass::SHADE, 340.0, 0.9),
    row(Item::OpaqueSplat, "opaque_splat", "splats", pass::OPAQUE, 190.0, 0.9),
    row(Item::OpaqueFragment, "opaque_fragment", "fragments", pass::OPAQUE, 3.4, 0.9),
    row(Item::ImageFragment, "image_fragment", "fragments of footprints by images", pass::OPAQUE, 98.0, 0.9),
    row(Item::MetFragment, "met_fragment", "fragments of discs that rays meet", pass::OPAQUE, 15.0, 0.9),
    row(Item::BlendedFragment, "blended_fragment", "fragments", pass::SPLAT, 2.7, 0.9),
    row(Item::BlendedSplat, "blended_splat", "splats", pass::SPLAT, 150.0, 0.9),
    row(Item::RangeSample, "range_sample", "samples", pass::SPLAT, 20.0, 0.9),
    row(Item::Particle, "particle", "particles", pass::PARTICLES, 80.0, 0.95),
    row(Item::CellParticle, "cell_particle", "particles of cells", pass::PARTICLES, 180.0, 0.95),
    row(Item::FieldParticle, "field_particle", "particles of formulas", pass::PARTICLES, 300.0, 0.95),
    row(Item::LatticeParticle, "lattice_particle", "particles of isosurfaces", pass::PARTICLES, 150.0, 0.95),
    row(Item::CubicParticle, "cubic_particle", "particles of cubic isosurfaces", pass::PARTICLES, 720.0, 0.95),
    row(Item::ScatteredParticle, "scattered_particle", "particles through points", pass::PARTICLES, 9900.0, 0.95),
    row(Item::SurveyedVoxel, "surveyed_voxel", "voxels", pass::SAMPLERS, 30.0, 0.9),
    row(Item::SearchedCell, "searched_cell", "cells about points", pass::SAMPLERS, 1.3e4, 0.9),
    row(Item::SetSample, "set_sample", "samples of sets", pass::PARTICLES, 170.0, 0.95),
    row(Item::SheetFragment, "sheet_fragment", "fragments", pass::SHEETS, 6.8, 0.9),
    row(Item::SweptRow, "swept_row", "rows of footprints", pass::SHEETS, 110.0, 0.9),
    row(Item::SoftSample, "soft_sample", "moved samples of lights", pass::SHEETS, 0.5, 0.9),
    row(Item::SlabSample, "slab_sample", "samples of slabs", pass::SHEETS, 71.0, 0.9),
    row(Item::MediumSample, "medium_sample", "samples of volumes in slabs", pass::SHEETS, 540.0, 0.9),
    row(Item::PolygonLook, "polygon_look", "looks of lights at polygons", pass::SHEETS, 55.0, 0.9),
    row(Item::SurfelDisc, "surfel_disc", "discs", pass::SURFELS, 550.0, 0.9),
    row(Item::BoxedDisc, "boxed_disc", "discs in boxes", pass::SURFELS, 900.0, 0.5),
    row(Item::SurfelFragment, "surfel_fragment", "fragments", pass::SURFELS, 10.0, 0.9),
    row(Item::SurfelSample, "surfel_sample", "samples", pass::SURFELS, 760.0, 0.9),
    row(Item::BentSample, "bent_sample", "samples with bent rays", pass::SURFELS, 8600.0, 0.9),
    row(Item::ExactFragment, "exact_fragment", "fragments", pass::REFERENCE, 1000.0, 0.9),
    row(Item::FinishedSample, "finished_sample", "samples", pass::FINISH, 82.0, 0.5),
    row(Item::EnvironmentSample, "environment_sample", "samples of an environment", pass::FINISH, 250.0, 0.5),
];

impl Item {
    /// Every kind, in the order of [`Item`].
    pub fn every() -> impl Iterator<Item = Self> {
        TABLE.iter().map(|row| row.item)
    }

    /// A splat that is made so.
    pub(crate) fn of_conversion(conversion: Conversion) -> Self {
        match conversion {
            Conversion::Plain => Self::ConvertedSplat,
            Conversion::Field => Self::FieldSplat,
            Conversion::SurfacePoint => Self::SurfacePoint,
            Conversion::MatterPoint => Self::MatterPoint,
        }
    }

    /// Its name in files of a machine.
    pub fn name(self) -> &'static str {
        TABLE[self as usize].name
    }

    /// Its name in sentences, plural.
    pub fn words(self) -> &'static str {
        TABLE[self as usize].words
    }

    /// What its number goes with.
    pub(crate) fn growth(self) -> Growth {
        match self {
            Self::FileByte
            | Self::GeneratedObject
            | Self::ConvertedSplat
            | Self::FieldSplat
            | Self::SurfacePoint
            | Self::MatterPoint
            | Self::CastSplat
            | Self::OpaqueCaster
            | Self::ShadowEntry
            | Self::ShadowRay
            | Self::SortedSplat
            | Self::SurveyedVoxel
            | Self::SearchedCell
            | Self::SoftSample
            | Self::SurfelDisc
            | Self::BoxedDisc
            | Self::GroupedDisc
            | Self::EnlargedDisc
            | Self::ProjectedSplat
            | Self::ShadedSplat
            | Self::ShadowLookUp
            | Self::OpaqueSplat
            | Self::BlendedSplat => Growth::Fixed,
            Self::OpaqueFragment
            | Self::ImageFragment
            | Self::MetFragment
            | Self::BlendedFragment
            | Self::RangeSample
            | Self::SheetFragment
            | Self::SweptRow
            | Self::SlabSample
            | Self::MediumSample
            | Self::PolygonLook
            | Self::SurfelFragment
            | Self::SurfelSample
            | Self::BentSample
            | Self::ExactFragment
            | Self::FinishedSample
            | Self::EnvironmentSample => Growth::Samples,
            Self::Particle
            | Self::CellParticle
            | Self::FieldParticle
            | Self::LatticeParticle
            | Self::CubicParticle
            | Self::ScatteredParticle
            | Self::SetSample => Growth::Sets,
        }
    }

    /// The pass whose time it makes up.
    pub fn pass(self) -> &'static str {
        TABLE[self as usize].pass
    }
}

/// Nanoseconds of each kind of item, built in or measured on a machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Rates {
    ns: Vec<f64>,
    source: String,
}

impl Default for Rates {
    fn default() -> Self {
        Self { ns: TABLE.iter().map(|row| row.ns).collect(), source: "built-in figures".to_owned() }
    }
}

impl Rates {
    /// The built-in figures with other nanoseconds of one core, each finite and ≥ 0; `source` names them in reports.
    pub fn measured(ns: impl Fn(Item) -> f64, source: String) -> Self {
        Self { ns: Item::every().map(ns).collect(), source }
    }

    /// Nanoseconds of one core that an item takes.
    pub fn ns(&self, item: Item) -> f64 {
        self.ns[item as usize]
    }

    /// Their origin.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Stages of progress with their predicted seconds, on the threads that run them. Passes that take turns have a stage in each round.
    pub(crate) fn stages(&self, passes: &[CountedPass]) -> Vec<(String, f64)> {
        let threads = rayon::current_num_threads();
        let mut stages = Vec::new();
        for taking_turns in passes.chunk_by(|a, b| a.rounds == b.rounds) {
            let rounds = taking_turns[0].rounds;
            let stage = |pass: &CountedPass| (pass.stage.clone(), pass.seconds(self, threads) / rounds as f64);
            (0..rounds).for_each(|_| stages.extend(taking_turns.iter().map(stage)));
        }
        stages
    }

    /// Seconds of so many items on so many threads, at least one.
    pub(super) fn seconds(&self, count: &Count, threads: usize) -> f64 {
        let parallel = TABLE[count.item as usize].parallel;
        let share = 1.0 - parallel + parallel / threads.max(1) as f64;
        1e-9 * self.ns(count.item) * count.number * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_its_own_row() {
        for (rank, item) in Item::every().enumerate() {
            assert_eq!(item as usize, rank, "{}", item.name());
        }
        let mut names: Vec<&str> = Item::every().map(Item::name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), TABLE.len());
        assert!(TABLE.iter().all(|row| row.ns > 0.0 && (0.0..=1.0).contains(&row.parallel)));
    }

    #[test]
    fn passes_that_take_turns_have_a_stage_in_each_round() {
        let pass = |stage: &str, rounds| {
            let counts = vec![Count::new(Item::FinishedSample, 1e6)];
            CountedPass { rounds, ..CountedPass::new(pass::FINISH, stage.to_owned(), counts) }
        };
        let stages = Rates::default().stages(&[pass("sort", 1), pass("a", 2), pass("b", 2), pass("finish", 1)]);
        let names: Vec<&str> = stages.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["sort", "a", "b", "a", "b", "finish"]);
        assert!((stages[0].1 - stages[1].1 - stages[3].1).abs() < 1e-12);
    }

    #[test]
    fn threads_divide_the_parallel_share_alone() {
        let rates = Rates::default();
        let count = Count::new(Item::Particle, 1e9);
        let [one, many] = [1, 1 << 20].map(|threads| rates.seconds(&count, threads));
        assert!((one - rates.ns(Item::Particle)).abs() < 1e-9 * one);
        let serial = 1.0 - TABLE[Item::Particle as usize].parallel;
        assert!((many / one - serial).abs() < 1e-5);
    }
}
