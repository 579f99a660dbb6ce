//! Hats: those of a file, or one that is made.

use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// What H shows and hides. A character's own holds its hair by itself while it is shown, one that is made by a collider.
#[derive(Component, Default)]
pub struct Hat(Option<HairCollider>);

/// Finds the hats that a character has, and makes one for a character without. They are off at first.
pub fn bring_hat(
    worn: On<HairWorn>,
    mut commands: Commands,
    children: Query<&Children>,
    names: Query<&Name>,
    hairs: Query<(&Transform, &ChildOf)>,
    hats: Query<(), With<Hat>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) -> Result {
    // Another hair of the same character.
    if children.iter_descendants(worn.entity).any(|e| hats.contains(e)) {
        return Ok(());
    }
    let is_hat = |e: &Entity| {
        names
            .get(*e)
            .is_ok_and(|name| ["Hat", "Helmet", "Hood"].iter().any(|hat| name.contains(hat)))
    };
    let own: Vec<Entity> = children.iter_descendants(worn.entity).filter(is_hat).collect();
    for hat in &own {
        commands.entity(*hat).insert((Hat::default(), Visibility::Hidden));
    }
    if !own.is_empty() {
        return Ok(());
    }
    // Hair has the head's size, its middle at the origin.
    let (hair, on) = hairs.get(worn.hair)?;
    let inside = HairCollider::inside(Vec3::new(0.105, 0.13, 0.125), 0.04)?;
    let hat = commands.spawn((Hat(Some(inside)), *hair, Visibility::Hidden, ChildOf(on.parent())));
    let hat = hat.id();
    let felt = materials.add(StandardMaterial {
        perceptual_roughness: 0.9,
        ..Color::srgb(0.12, 0.16, 0.24).into()
    });
    let at = |y: f32| Transform::from_xyz(0.0, y, 0.0).with_scale(Vec3::new(1.0, 1.0, 1.2));
    for (radius, height, y) in [(0.16, 0.006, 0.04), (0.105, 0.1, 0.09)] {
        let part = Mesh3d(meshes.add(Cylinder::new(radius, height)));
        commands.spawn((part, MeshMaterial3d(felt.clone()), at(y), ChildOf(hat)));
    }
    Ok(())
}

pub fn put_on_hats(
    keys: Res<ButtonInput<KeyCode>>,
    hats: Query<(Entity, &Hat, &mut Visibility)>,
    commands: Commands,
) {
    if keys.just_pressed(KeyCode::KeyH) {
        toggle(hats, commands);
    }
}

pub fn toggle(mut hats: Query<(Entity, &Hat, &mut Visibility)>, mut commands: Commands) {
    for (hat, Hat(collider), mut visibility) in &mut hats {
        visibility.toggle_inherited_hidden();
        match collider {
            Some(collider) if *visibility != Visibility::Hidden => {
                commands.entity(hat).insert(collider.clone());
            }
            _ => {
                commands.entity(hat).remove::<HairCollider>();
            }
        }
    }
}
