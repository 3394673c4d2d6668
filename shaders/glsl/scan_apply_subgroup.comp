#version 450
#extension GL_KHR_shader_subgroup_arithmetic : require
// As `scan_apply`, by sums of subgroups.

#include "blocks.glsl"
#include "layouts.glsl"
#include "subgroup_scan.glsl"
#include "scan_apply.glsl"
