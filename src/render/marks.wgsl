// Marks of hair in the alpha channel of the picture, of which the mean over a pixel's samples still tells how many are
// hair and which way it lies.
#define_import_path bevy_keratin::marks

#import bevy_render::maths::PI

// Of `samples` a pixel, how much alpha lacks at one of hair at least, and how much more by its direction: so little
// that even all of them do not look like one more.
fn direction_part(samples: f32) -> f32 {
    return min(0.9 / samples, 0.5);
}

fn least_lack(samples: f32) -> f32 {
    return 0.99 - direction_part(samples);
}

// In every other pixel directions begin a quarter turn later: where the mean of two that differ little is wrong, since
// one is at the beginning and one at the end, it is right beside.
fn begin(pixel: vec2<i32>) -> f32 {
    return 0.5 * f32((pixel.x + pixel.y) & 1);
}

// The alpha of a sample of hair that lies along `way`, up or down.
fn marked(way: vec2<f32>, pixel: vec2<i32>, samples: f32) -> f32 {
    // Along the line of sight it has none.
    let turn = select(atan2(way.y, way.x) / PI, 0.0, dot(way, way) <= 1e-20);
    return 1.0 - least_lack(samples) - direction_part(samples) * fract(turn + begin(pixel));
}

// Share of a pixel's samples that are hair; twice the angle of its direction, as long as the share.
struct Mark {
    share: f32,
    twice: vec2<f32>,
}

fn mark_of(alpha: f32, pixel: vec2<i32>, samples: f32) -> Mark {
    let lack = (1.0 - alpha) * samples;
    let least = least_lack(samples);
    let count = min(floor(lack / least + 0.02), samples);
    // What is more is no mark: nothing has been drawn there.
    if count < 1.0 || lack > 0.995 * samples {
        return Mark(0.0, vec2(0.0));
    }
    let turn = saturate((lack / count - least) / direction_part(samples)) - begin(pixel);
    let share = count / samples;
    return Mark(share, share * vec2(cos(2.0 * PI * turn), sin(2.0 * PI * turn)));
}
