//! What the panel does to the blower and the rod: values that the user has set win over the scene's.

use crate::scenes::{Model, Prop, Treated};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// The user's values; `None` where the scene's hold.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct Tools {
    /// Acceleration across the wind (m/s²).
    pub strength: Option<f32>,
    /// Bonds that form per velocity received (s/m).
    pub drying: Option<f32>,
    /// Where the mouth of the blower is (m).
    pub place: Option<Vec3>,
    /// The rod's radius (m).
    pub radius: Option<f32>,
}

/// Where the scene puts the blower, and at what it aims (m).
pub const BLOWER_PLACE: Vec3 = Vec3::new(0.0, 0.12, -0.25);
const BLOWER_AIM: Vec3 = Vec3::new(0.01, 0.0, 0.0);

/// A blower that the user has taken, not the scene's.
#[derive(Component)]
pub struct Borrowed;

/// A blower for any scene.
pub fn blower() -> impl Bundle {
    let place = Transform::from_translation(BLOWER_PLACE).looking_at(BLOWER_AIM, Vec3::Y);
    (Prop, Borrowed, Model::Blower, Blower::default(), place)
}

/// The scene's own blower takes the place of a borrowed one.
pub fn give_back(
    mut commands: Commands,
    scene: Query<(), (Added<Blower>, Without<Borrowed>)>,
    borrowed: Query<Entity, With<Borrowed>>,
) {
    if !scene.is_empty() {
        borrowed.iter().for_each(|entity| commands.entity(entity).despawn());
    }
}

/// Applies the values to tools that are there and to those that the scene brings.
pub fn apply(
    tools: Res<Tools>,
    mut blowers: Query<(&mut Blower, &mut Transform), Without<PermRod>>,
    mut rods: Query<(&mut PermRod, &mut Transform, &mut Model), Without<Blower>>,
    hairs: Query<&Transform, (With<Treated>, Without<PermRod>, Without<Blower>)>,
) {
    for (mut blower, mut transform) in &mut blowers {
        if !tools.is_changed() && !blower.is_added() {
            continue;
        }
        blower.strength = tools.strength.unwrap_or(blower.strength);
        blower.drying = tools.drying.unwrap_or(blower.drying);
        if let Some(place) = tools.place {
            *transform = Transform::from_translation(place).looking_at(BLOWER_AIM, Vec3::Y);
        }
    }
    for (mut rod, mut transform, mut model) in &mut rods {
        let Some(radius) = tools.radius.filter(|r| *r != rod.radius) else { continue };
        rod.radius = radius;
        *model = Model::Rod(radius, rod.length);
        // The strands stay tangents of it.
        if let Some(hair) = hairs.iter().next() {
            transform.translation.x = hair.translation.x + radius;
        }
    }
}
