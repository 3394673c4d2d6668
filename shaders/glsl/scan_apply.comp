#version 450
// The exclusive scan of the numbers in place, each block begun at its scanned sum.

#define PLACE gl_LocalInvocationIndex

#include "blocks.glsl"
#include "layouts.glsl"
#include "scan.glsl"
#include "scan_apply.glsl"
