#version 450
// What one splat adds to one pixel: channels multiplied by its opacity, the opacity, and its optical depth. Blending does
// the rest.

#include "layouts.glsl"
#include "optics.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uvec4 tables[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { float opaque_depth[]; };

// As `splat_draw.vert` hands them on: a splat's own.
layout(location = 0) flat in vec4 shape;
layout(location = 1) flat in vec4 peak;
layout(location = 2) flat in vec4 color;
layout(location = 3) flat in vec2 slope;
layout(location = 4) flat in uint look;

layout(location = 0) out vec4 blended;
layout(location = 1) out float thickness;

#include "fragment.glsl"

void main() {
    Pixel pixel;
    pixel.at = uvec2(gl_FragCoord.xy);
    pixel.ray_factor = ray_factor_of(pixel.at);
    pixel.hidden = false;
    pixel.solid = 0.0;
    if (view.opaque != 0u) {
        pixel.solid = opaque_depth[pixel.at.y * uint(view.size.x) + pixel.at.x];
        pixel.hidden = pixel.solid < 3.0e38;
    }
    Shape placed = Shape(vec4(origin_of(pixel.at, shape.xy), shape.zw), peak, slope, look);
    precise float tau = optical_depth(placed, pixel) * color.w;
    float opacity = opacity_of(tau);
    blended = vec4(color.rgb * opacity, opacity);
    thickness = tau;
}
