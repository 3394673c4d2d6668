#version 450
// Composites the splats of each tile, with the depths at which light is absorbed and the objects that are seen.

#define PLANES 3u
#define CHANNELS MOST_CHANNELS
#define LAYERS

#include "blocks.glsl"
#include "layouts.glsl"
#include "splats.glsl"
#include "optics.glsl"
#include "composite.glsl"
