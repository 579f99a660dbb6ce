// Hair averaged along its strands (Cabral & Leedom 1993, "Imaging vector fields using line integral convolution").

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput

// Of `smoothing.rs`.
struct Smooth {
    reach: f32,
    across: f32,
}

@group(0) @binding(0) var screen: texture_2d<f32>;
// As `material.rs` says.
@group(0) @binding(1) var marks: texture_2d<f32>;
@group(0) @binding(2) var<uniform> smooth_by: Smooth;

// Share of a pixel's samples that are hair; twice the angle of its direction, as long as the share.
struct Mark {
    share: f32,
    twice: vec2<f32>,
}

fn mark_of(pixel: vec2<i32>) -> Mark {
    let mark = textureLoad(marks, pixel, 0);
    return Mark(mark.b, 2.0 * mark.rg - 1.0);
}

fn inside(pixel: vec2<i32>) -> vec2<i32> {
    return clamp(pixel, vec2(0), vec2<i32>(textureDimensions(screen)) - 1);
}

// Of a pixel and the eight around it: hair may have lit no sample of one, and means show its direction better.
fn mark_around(pixel: vec2<i32>) -> Mark {
    var sum = Mark(0.0, vec2(0.0));
    for (var i = 0; i < 9; i++) {
        let at = inside(pixel + vec2(i % 3 - 1, i / 3 - 1));
        let mark = mark_of(at);
        sum.share += mark.share;
        sum.twice += mark.twice;
    }
    return sum;
}

struct Sum {
    color: vec4<f32>,
    // Of it, that is hair.
    share: f32,
    // The color of pixels without hair, and how much of the weight they have.
    bare: vec4<f32>,
    bare_weight: f32,
    weight: f32,
}

fn joined(a: Sum, b: Sum) -> Sum {
    return Sum(a.color + b.color, a.share + b.share, a.bare + b.bare,
        a.bare_weight + b.bare_weight, a.weight + b.weight);
}

fn scaled(a: Sum, by: f32) -> Sum {
    return Sum(by * a.color, by * a.share, by * a.bare, by * a.bare_weight, by * a.weight);
}

// A pixel, and a little of those beside it.
fn line(pixel: vec2<i32>, across: vec2<i32>) -> Sum {
    var sum = Sum(vec4(0.0), 0.0, vec4(0.0), 0.0, 0.0);
    for (var side = -1; side <= 1; side++) {
        let at = inside(pixel + side * across);
        let color = textureLoad(screen, at, 0);
        let share = mark_of(at).share;
        let weight = select(smooth_by.across, 1.0, side == 0);
        let bare = select(0.0, weight, share == 0.0);
        sum = joined(sum, Sum(weight * color, weight * share, bare * color, bare, weight));
    }
    return sum;
}

@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(in.position.xy);
    let own = textureLoad(screen, pixel, 0);
    let here = mark_around(pixel);
    if here.share == 0.0 {
#ifdef MULTISAMPLED
        discard;
#endif
        return own;
    }
    // One pixel along the longer axis.
    let angle = select(0.5 * atan2(here.twice.y, here.twice.x), 0.0, dot(here.twice, here.twice) <= 1e-12);
    let way = vec2(cos(angle), sin(angle));
    let step = way / max(abs(way.x), abs(way.y));
    let across = select(vec2(1, 0), vec2(0, 1), abs(way.x) > abs(way.y));
    var sum = line(pixel, across);
    // Where strands curl and cross within pixels there is no line to go along: 1 if all go one way, 0 if any.
    let ordered = length(here.twice) / here.share;
    var was_bare = false;
    // As far one way as the other, or hair would grow past its edges; thin hair has gaps of a pixel.
    for (var i = 1; i <= i32(smooth_by.reach); i++) {
        let ahead = line(vec2<i32>(floor(in.position.xy + f32(i) * step)), across);
        let back = line(vec2<i32>(floor(in.position.xy - f32(i) * step)), across);
        let is_bare = min(ahead.share, back.share) == 0.0;
        if is_bare && was_bare {
            break;
        }
        was_bare = is_bare;
        sum = joined(sum, scaled(joined(ahead, back), ordered));
    }
    var color = sum.color / sum.weight;
    // Where no strand is, the ground of this place is seen, not of those along the line.
    if mark_of(pixel).share == 0.0 {
        color += (1.0 - sum.share / sum.weight) * (own - sum.bare / max(sum.bare_weight, 1e-6));
    }
    return color;
}
