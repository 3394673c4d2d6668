// Written by `cargo xtask shaders` from src/layouts.rs.

#define MOST_CHANNELS 16u

struct SortView {
    vec4 axis_x;
    vec4 axis_y;
    vec4 axis_z;
    vec4 translation;
    vec2 plane_cos;
    vec2 plane_sin;
    vec2 half_extent;
    uint splats;
    uint back_to_front;
};

struct Scan {
    uint count;
    uint total;
};

struct SortState {
    uint kept;
    uint sorted;
    uint blocks;
    uint near_key;
    uint far_key;
    uint radius_key;
    uint sort_groups_x;
    uint sort_groups_y;
    uint sort_groups_z;
    uint scan_groups_x;
    uint scan_groups_y;
    uint scan_groups_z;
};

struct SplatView {
    vec2 middle;
    vec2 size;
    float focal;
    float cutoff;
    uint columns;
    uint tiles;
    uint ordered;
    uint splat_words;
    uint footprints;
    uint planes;
    uint channels;
    uint opaque;
    uint back_to_front;
    uint fresh;
    uint materials;
    uint depths;
    uint objects;
    uint colors;
};

struct SplatState {
    uint entries_low;
    uint entries_high;
    uint splats;
    uint longest;
};

struct ProjectView {
    vec4 axis_x;
    vec4 axis_y;
    vec4 axis_z;
    vec4 translation;
    vec2 middle;
    vec2 size;
    float focal;
    float filter_sigma;
    uint orthographic;
    uint splats;
    uint splat_words;
    uint frame_words;
    uint footprints;
    uint unused;
};

struct ProjectState {
    uint visible;
    uint near;
};

struct ShadeView {
    vec4 eye;
    vec4 ambient;
    uint orthographic;
    uint splats;
    uint frame_words;
    uint materials;
    uint lights;
    uint channels;
    uint layers;
    uint unused;
};

struct ParticleObject {
    vec4 linear_x;
    vec4 linear_y;
    vec4 linear_z;
    vec4 translation;
    vec4 rotation_x;
    vec4 rotation_y;
    vec4 rotation_z;
    vec4 emission;
    vec4 share;
};

struct ParticleView {
    vec4 world_x;
    vec4 world_y;
    vec4 world_z;
    vec2 middle;
    vec2 size;
    float focal;
    float inverse_unit;
    uint orthographic;
    uint columns;
    uint pixels;
    uint at_once;
    uint channels;
    uint light_channels;
};

struct ParticleSource {
    vec4 axis_x;
    vec4 axis_y;
    vec4 axis_z;
    vec4 gradient_x;
    vec4 gradient_y;
    vec4 gradient_z;
    vec4 tint;
    uvec2 key;
    uvec2 thinning;
    uvec2 first_set;
    uvec2 lattice;
    uint chunks;
    uint first_chunk;
    uint all_chunks;
    uint levels;
    uint object;
    uint unused;
    uint flags;
    uint slots_at;
    uint vertex_words;
    uint pieces;
    float level;
    float weight;
};

struct ParticlesFound {
    uint total;
    uint most;
};

struct ListView {
    uvec2 stop;
    uint entries;
    uint cells;
    uint channels;
    uint unused;
};

struct ShadowView {
    vec2 least;
    uvec2 size;
    float cell;
    float ramp;
    float dark_from;
    uint mapping;
    uint receivers;
    uint channels;
    uint opaque;
    uint unused;
};

struct CastView {
    vec4 axis_x;
    vec4 axis_y;
    vec4 axis_z;
    vec4 light_high;
    vec4 light_low;
    vec2 least;
    uvec2 size;
    float cell;
    uint mapping;
    float inverse_measure;
    float unit;
    float bias;
    uint splats;
    uint casters;
    uint given;
    uint frame_words;
    uint footprint_vectors;
    uint channels;
    uint opaque;
    uint materials;
    uint footprints;
    uint shares;
    uint unused;
};

struct CastState {
    uint entries;
};
