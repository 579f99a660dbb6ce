//! The bones: where they are at rest, and how they walk.

use bevy::prelude::*;
use core::f32::consts::TAU;

pub const CHEST: usize = 2;
pub const NECK: usize = 3;
pub const HEAD: usize = 4;
/// Bones of the left side; those of the right follow in the same order.
pub const UPPER_ARM: usize = 5;
pub const FOREARM: usize = 6;
pub const THIGH: usize = 7;
pub const SHIN: usize = 8;
pub const FOOT: usize = 9;
/// From a bone of the left side to its twin.
pub const OTHER_SIDE: usize = 5;
pub const COUNT: usize = 15;

/// The skull's centre (m), above the floor.
pub const SKULL: Vec3 = Vec3::new(0.0, 1.6, 0.0);

/// Parent and joint (m) of each bone of the middle and the left side, standing with arms half down.
const REST: [(usize, Vec3); 10] = [
    (0, Vec3::new(0.0, 0.93, -0.02)),
    (0, Vec3::new(0.0, 1.04, -0.025)),
    (1, Vec3::new(0.0, 1.18, -0.03)),
    (CHEST, Vec3::new(0.0, 1.42, -0.035)),
    (NECK, Vec3::new(0.0, 1.53, -0.012)),
    (CHEST, Vec3::new(0.168, 1.345, -0.04)),
    (UPPER_ARM, Vec3::new(0.284, 1.096, -0.04)),
    (0, Vec3::new(0.09, 0.90, -0.02)),
    (THIGH, Vec3::new(0.095, 0.49, -0.005)),
    (SHIN, Vec3::new(0.095, 0.085, -0.035)),
];

pub fn parent(bone: usize) -> Option<usize> {
    match bone {
        0 => None,
        _ if bone < REST.len() => Some(REST[bone].0),
        _ => {
            let parent = REST[bone - OTHER_SIDE].0;
            Some(if parent < UPPER_ARM { parent } else { parent + OTHER_SIDE })
        }
    }
}

/// A bone's joint at rest (m).
pub fn joint(bone: usize) -> Vec3 {
    match REST.get(bone) {
        Some(&(_, place)) => place,
        None => REST[bone - OTHER_SIDE].1 * Vec3::new(-1.0, 1.0, 1.0),
    }
}

/// A bone's place in its parent at rest.
pub fn at_rest(bone: usize) -> Transform {
    Transform::from_translation(joint(bone) - parent(bone).map_or(Vec3::ZERO, joint))
}

/// From the space of the skin to each bone's, at rest.
pub fn inverse_poses() -> Vec<Mat4> {
    (0..COUNT).map(|bone| Mat4::from_translation(-joint(bone))).collect()
}

/// Spawns a figure and its bones, at rest.
pub fn spawn(commands: &mut Commands) -> (Entity, Vec<Entity>) {
    let figure = commands.spawn((path(0.0), Name::new("Figure"))).id();
    let mut bones: Vec<Entity> = Vec::new();
    for bone in 0..COUNT {
        let above = parent(bone).map_or(figure, |parent| bones[parent]);
        let name = match bone {
            HEAD => Name::new("Head"),
            _ => Name::new(format!("Bone {bone}")),
        };
        bones.push(commands.spawn((name, at_rest(bone), ChildOf(above))).id());
    }
    (figure, bones)
}

/// How fast it walks (m/s), and how many double steps it takes in a second.
pub const SPEED: f32 = 1.2;
const PACE: f32 = 0.92;
/// The circle that it walks (m).
pub const CIRCLE: f32 = 1.3;

/// Where the figure is after `seconds`, its feet on the floor.
pub fn path(seconds: f32) -> Transform {
    let angle = SPEED / CIRCLE * seconds;
    let (sine, cosine) = angle.sin_cos();
    Transform::from_xyz(CIRCLE * sine, 0.0, CIRCLE * cosine)
        .with_rotation(Quat::from_rotation_y(angle + 0.25 * TAU))
}

/// Looks to one side, ahead, quickly to the other (rad).
fn look(seconds: f32) -> f32 {
    const LOOKS: [(f32, f32); 7] =
        [(0.0, 0.0), (1.2, 0.0), (1.6, 0.9), (2.4, 0.9), (2.75, -0.9), (3.6, -0.9), (4.2, 0.0)];
    let time = seconds.rem_euclid(5.0);
    let next = LOOKS.iter().position(|l| l.0 > time);
    next.map_or(0.0, |i| {
        let ((t0, a0), (t1, a1)) = (LOOKS[i - 1], LOOKS[i]);
        let share = (time - t0) / (t1 - t0);
        a0 + (a1 - a0) * share * share * (3.0 - 2.0 * share)
    })
}

/// Thigh, knee and foot of a leg at a phase of its step (rad, positive bends to the back).
fn leg(phase: f32) -> [f32; 3] {
    let thigh = -0.36 * phase.sin() - 0.06;
    // The knee bends while the leg swings to the front.
    let knee = 0.16 + 0.75 * (phase + 0.45).cos().max(0.0).powi(2);
    // Flat while it stands, the heel first where it lands, the toes last where it leaves.
    let foot = -0.75 * (thigh + knee) - 0.1 * phase.sin();
    [thigh, knee, foot]
}

/// How the bones are after `seconds` of walking.
pub fn walk(seconds: f32) -> [Transform; COUNT] {
    let mut bones = core::array::from_fn(at_rest);
    let phase = TAU * PACE * seconds;
    let x = Quat::from_rotation_x;
    let y = Quat::from_rotation_y;
    let sway = phase.sin();
    let mut reach = 0.0_f32;
    for (side, own) in [(0, phase), (OTHER_SIDE, phase + 0.5 * TAU)] {
        let [thigh, knee, foot] = leg(own);
        bones[THIGH + side].rotation = x(thigh) * y(0.08 * sway);
        bones[SHIN + side].rotation = x(knee);
        bones[FOOT + side].rotation = x(foot);
        // How far the sole is below the hip.
        let place = [SHIN, FOOT].map(at_rest).map(|t| t.translation);
        let ankle = x(thigh) * (place[0] + x(knee) * place[1]);
        reach = reach.max(-ankle.y);
        let is_left = if side == 0 { 1.0 } else { -1.0 };
        let swing = 0.02 + 0.42 * own.sin();
        let down = Quat::from_rotation_z(-0.3 * is_left);
        bones[UPPER_ARM + side].rotation = x(swing) * down;
        bones[FOREARM + side].rotation = x(-0.16 - 0.2 * (1.0 - own.sin()));
    }
    // The leg that stands carries it.
    bones[0].translation.y = reach + joint(FOOT).y + joint(0).y - joint(THIGH).y;
    bones[0].rotation = y(-0.08 * sway) * Quat::from_rotation_z(0.03 * phase.cos()) * x(0.03);
    bones[1].rotation = y(0.06 * sway) * Quat::from_rotation_z(-0.03 * phase.cos());
    bones[CHEST].rotation = y(0.08 * sway) * x(0.02);
    let look = look(seconds) - 0.06 * sway;
    bones[NECK].rotation = y(0.4 * look);
    bones[HEAD].rotation = y(0.6 * look) * x(-0.05 + 0.03 * (2.0 * phase).cos());
    bones
}
