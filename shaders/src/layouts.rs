//! The shared structs. Vectors of four and pairs come first, so that std430 and C lay them out alike.

use crate::layout::layouts;

/// The most channels of a splat for which kernels that keep them apart make room.
pub const MOST_CHANNELS: u32 = 16;

layouts! {
    /// The view of one cloud, with which splats are culled and projected.
    pub struct SortView {
        /// First column of the rotation from world offsets to view space; the fourth number is unused.
        pub axis_x: [f32; 4],
        /// Second column.
        pub axis_y: [f32; 4],
        /// Third column.
        pub axis_z: [f32; 4],
        /// View position of the cloud's origin.
        pub translation: [f32; 4],
        /// cos φ of the half angles across and down; 1 for parallel rays.
        pub plane_cos: [f32; 2],
        /// sin φ; 0 for parallel rays.
        pub plane_sin: [f32; 2],
        /// Half extent of the image, world units; 0 for a pinhole.
        pub half_extent: [f32; 2],
        /// Splats to look at.
        pub splats: u32,
        /// 1 where the farthest comes first.
        pub back_to_front: u32,
    }

    /// A scan: how many numbers it runs over, and what they add up to.
    pub struct Scan {
        /// Numbers.
        pub count: u32,
        /// Their sum.
        pub total: u32,
    }

    /// What a sort found, and the sizes of its indirect dispatches.
    pub struct SortState {
        /// Splats in the view, whether there was room for them or not.
        pub kept: u32,
        /// Splats that are sorted: `kept`, or the room.
        pub sorted: u32,
        /// Workgroups' blocks of sorted splats.
        pub blocks: u32,
        /// Key of the nearest kept depth.
        pub near_key: u32,
        /// Key of the farthest kept depth.
        pub far_key: u32,
        /// Key of the smallest radius, culled splats included.
        pub radius_key: u32,
        /// Workgroups across, down and deep over the blocks of sorted splats.
        pub sort_groups_x: u32,
        /// Down.
        pub sort_groups_y: u32,
        /// Deep.
        pub sort_groups_z: u32,
        /// Workgroups across, down and deep of the scan of digit counts.
        pub scan_groups_x: u32,
        /// Down.
        pub scan_groups_y: u32,
        /// Deep.
        pub scan_groups_z: u32,
    }

    /// The image that splats are composited into, and what is given of them.
    pub struct SplatView {
        /// Half the size, pixels.
        pub middle: [f32; 2],
        /// Width and height, pixels.
        pub size: [f32; 2],
        /// Focal length, pixels; 0 for parallel rays.
        pub focal: f32,
        /// A tile is done when all its transmittances are below this.
        pub cutoff: f32,
        /// Tiles across.
        pub columns: u32,
        /// Tiles.
        pub tiles: u32,
        /// Splats of the order.
        pub ordered: u32,
        /// Words of a splat: 8, or 12 with depths.
        pub splat_words: u32,
        /// Footprints of the table; the extinctions of materials come behind them.
        pub footprints: u32,
        /// Planes of optical depth, 1 or 3.
        pub planes: u32,
        /// Channels.
        pub channels: u32,
        /// 1 where an opaque surface may hide splats.
        pub opaque: u32,
        /// 1 where the farthest comes first.
        pub back_to_front: u32,
        /// 1 where the planes hold nothing yet.
        pub fresh: u32,
        /// Materials of the table.
        pub materials: u32,
        /// 1 where depths are made.
        pub depths: u32,
        /// 1 where objects are kept.
        pub objects: u32,
        /// Channels that are red, green and blue in threes; they come first.
        pub colors: u32,
    }

    /// What the counting of tiles found.
    pub struct SplatState {
        /// Entries, whether there is room for them or not: the lower 32 bits.
        pub entries_low: u32,
        /// The upper ones.
        pub entries_high: u32,
        /// Splats that reach a tile.
        pub splats: u32,
        /// Entries of the tile that has most.
        pub longest: u32,
    }

    /// The view that splats are projected into.
    pub struct ProjectView {
        /// First column of the rotation from world offsets to view space; the fourth number is unused.
        pub axis_x: [f32; 4],
        /// Second column.
        pub axis_y: [f32; 4],
        /// Third column.
        pub axis_z: [f32; 4],
        /// View position of the cloud's origin.
        pub translation: [f32; 4],
        /// Half the size, pixels.
        pub middle: [f32; 2],
        /// Width and height, pixels.
        pub size: [f32; 2],
        /// Focal length, pixels; pixels a world unit for parallel rays.
        pub focal: f32,
        /// Standard deviation of the resampling filter, pixels.
        pub filter_sigma: f32,
        /// 1 for parallel rays.
        pub orthographic: u32,
        /// Splats.
        pub splats: u32,
        /// Words of a projected splat: 8, or 12 with depths.
        pub splat_words: u32,
        /// Words of a splat's normal and semi-axis: 0, 3 or 6.
        pub frame_words: u32,
        /// Footprints of the table; materials come behind them.
        pub footprints: u32,
        /// Nothing.
        pub unused: u32,
    }

    /// What a projection found.
    pub struct ProjectState {
        /// Splats that reach a pixel.
        pub visible: u32,
        /// Those that are discs through the eye plane.
        pub near: u32,
    }

    /// What shading reads beside splats and tables.
    pub struct ShadeView {
        /// The eye as an offset; for parallel rays the direction to it. The fourth number is unused.
        pub eye: [f32; 4],
        /// Ambient radiance.
        pub ambient: [f32; 4],
        /// 1 for parallel rays.
        pub orthographic: u32,
        /// Splats.
        pub splats: u32,
        /// Words of a splat's normal and semi-axis: 0, 3 or 6.
        pub frame_words: u32,
        /// Materials of the table; lights come behind them.
        pub materials: u32,
        /// Lights.
        pub lights: u32,
        /// Numbers a splat.
        pub channels: u32,
        /// 1 where effects are kept apart, + 2 where the normal is a channel, + 4 the shadow.
        pub layers: u32,
        /// Nothing.
        pub unused: u32,
    }

    /// One object of a set of particles.
    pub struct ParticleObject {
        /// First column of the map from its offsets to view space; the fourth number is unused.
        pub linear_x: [f32; 4],
        /// Second column.
        pub linear_y: [f32; 4],
        /// Third column.
        pub linear_z: [f32; 4],
        /// View position of its origin.
        pub translation: [f32; 4],
        /// First column of the rotation of its normals.
        pub rotation_x: [f32; 4],
        /// Second column.
        pub rotation_y: [f32; 4],
        /// Third column.
        pub rotation_z: [f32; 4],
        /// Radiance that it emits; the unit of its particles' colours.
        pub emission: [f32; 4],
        /// s·f² in view units; radius near lights and in shadows; kind of splat; share of a shadow that is received.
        pub share: [f32; 4],
    }

    /// The image that particles are projected on.
    pub struct ParticleView {
        /// First axis of the view in the world; the fourth number is unused.
        pub world_x: [f32; 4],
        /// Second axis.
        pub world_y: [f32; 4],
        /// The view's direction.
        pub world_z: [f32; 4],
        /// Half the size, pixels.
        pub middle: [f32; 2],
        /// Width and height, pixels.
        pub size: [f32; 2],
        /// Focal length, pixels; pixels a world unit for parallel rays.
        pub focal: f32,
        /// 1 over the unit of radiance.
        pub inverse_unit: f32,
        /// 1 for parallel rays.
        pub orthographic: u32,
        /// Tiles across.
        pub columns: u32,
        /// Pixels of all tiles.
        pub pixels: u32,
        /// Pixels of a part, whose particles are lit at once.
        pub at_once: u32,
        /// Numbers that a hit brings.
        pub channels: u32,
        /// Those of them that are light.
        pub light_channels: u32,
    }

    /// A sampler whose sets the device makes itself.
    pub struct ParticleSource {
        /// First axis of a volume's lattice; the fourth number is where its last voxel ends, lattice coordinates.
        pub axis_x: [f32; 4],
        /// Second axis.
        pub axis_y: [f32; 4],
        /// Third axis.
        pub axis_z: [f32; 4],
        /// First column of the map from gradients in lattice steps to the world's.
        pub gradient_x: [f32; 4],
        /// Second column.
        pub gradient_y: [f32; 4],
        /// Third column.
        pub gradient_z: [f32; 4],
        /// Colour of particles that have none of their own, or factor on the colours of vertices; the fourth number is unused.
        pub tint: [f32; 4],
        /// Hash of seed and stage, the lower half first.
        pub key: [u32; 2],
        /// Hash of the object and of the stage that thins out.
        pub thinning: [u32; 2],
        /// Number of the first set of a run.
        pub first_set: [u32; 2],
        /// Lattice points along the first two axes.
        pub lattice: [u32; 2],
        /// Chunks of a set of this object.
        pub chunks: u32,
        /// Chunks of the objects before.
        pub first_chunk: u32,
        /// Chunks of all objects.
        pub all_chunks: u32,
        /// Sets of a run.
        pub levels: u32,
        /// The object.
        pub object: u32,
        /// Nothing.
        pub unused: u32,
        /// 1 where opacity does not depend on the angle, + 2 where there are normals, + 4 colours of vertices.
        pub flags: u32,
        /// Where the alias tables begin, words.
        pub slots_at: u32,
        /// Words of a vertex, or of a splat.
        pub vertex_words: u32,
        /// Pieces of the transfer function.
        pub pieces: u32,
        /// Value of an isosurface.
        pub level: f32,
        /// What the gradients of an isosurface are weighed with.
        pub weight: f32,
    }

    /// What was made of sets, whether there was room for it or not.
    pub struct ParticlesFound {
        /// Particles of all sets of a run.
        pub total: u32,
        /// Particles of the set that has most.
        pub most: u32,
    }

    /// The entries that lists are made of.
    pub struct ListView {
        /// A list stops where every channel has reached this: fixed point, 2⁴⁴ units an absorbance of 1, the lower half first.
        pub stop: [u32; 2],
        /// Entries.
        pub entries: u32,
        /// Cells.
        pub cells: u32,
        /// Channels, 1 or 3.
        pub channels: u32,
        /// Nothing.
        pub unused: u32,
    }

    /// A shadow map and what is looked up in it.
    pub struct ShadowView {
        /// Lower corner of a planar table.
        pub least: [f32; 2],
        /// Columns and rows.
        pub size: [u32; 2],
        /// Side of a cell of a planar table.
        pub cell: f32,
        /// Half width of a medium's entry along the ray.
        pub ramp: f32,
        /// Light ends above this absorbance.
        pub dark_from: f32,
        /// 0 octahedral, 1 planar with rays from a point, 2 planar with parallel rays.
        pub mapping: u32,
        /// Receivers.
        pub receivers: u32,
        /// Channels, 1 or 3.
        pub channels: u32,
        /// 1 where an opaque disc may end a list.
        pub opaque: u32,
        /// Nothing.
        pub unused: u32,
    }

    /// The light's frame and table, and the splats that deposit absorbance there.
    pub struct CastView {
        /// First column of the rotation from offsets to the table's axes; the fourth number is unused.
        pub axis_x: [f32; 4],
        /// Second column.
        pub axis_y: [f32; 4],
        /// Third column.
        pub axis_z: [f32; 4],
        /// The light as an offset.
        pub light_high: [f32; 4],
        /// What is left of it after rounding.
        pub light_low: [f32; 4],
        /// Lower corner of a planar table.
        pub least: [f32; 2],
        /// Columns and rows.
        pub size: [u32; 2],
        /// Side of a cell of a planar table.
        pub cell: f32,
        /// 0 octahedral, 1 planar with rays from a point, 2 planar with parallel rays.
        pub mapping: u32,
        /// 1 over the measure of a cell of an octahedral table.
        pub inverse_measure: f32,
        /// Frame units per world unit.
        pub unit: f32,
        /// A receiver's radius to its lift.
        pub bias: f32,
        /// Splats, all of which may receive.
        pub splats: u32,
        /// Those that deposit here.
        pub casters: u32,
        /// Entries that are there before.
        pub given: u32,
        /// Words of a splat's normal and semi-axis: 0, 3 or 6.
        pub frame_words: u32,
        /// Vectors of a footprint: 2, or 4 with planes and colours.
        pub footprint_vectors: u32,
        /// Channels, 1 or 3.
        pub channels: u32,
        /// 1 where an opaque disc may end a list.
        pub opaque: u32,
        /// Materials of the table; one for unknown ones and footprints come behind them.
        pub materials: u32,
        /// Footprints.
        pub footprints: u32,
        /// Numbers of shares of the shadow: one a splat, or one for all.
        pub shares: u32,
        /// Nothing.
        pub unused: u32,
    }

    /// What depositing found.
    pub struct CastState {
        /// Entries, whether there is room for them or not.
        pub entries: u32,
    }
}
