#version 450
// Composites the splats of each tile: up to three planes of optical depth and all channels that shading gives.

#define PLANES 3u
#define CHANNELS MOST_CHANNELS

#include "blocks.glsl"
#include "layouts.glsl"
#include "splats.glsl"
#include "optics.glsl"
#include "composite.glsl"
