//! Hats: those of a file, or one that is made.

use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// What H shows and hides.
#[derive(Component)]
pub struct Hat;

/// Finds the hats that a character has, and makes one for a character without. They are off at first.
pub fn bring_hat(
    worn: On<HairWorn>,
    mut commands: Commands,
    children: Query<&Children>,
    names: Query<&Name>,
    hairs: Query<(&Transform, &ChildOf)>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) -> Result {
    let is_hat = |e: &Entity| {
        names
            .get(*e)
            .is_ok_and(|name| ["Hat", "Helmet", "Hood"].iter().any(|hat| name.contains(hat)))
    };
    let own: Vec<Entity> = children.iter_descendants(worn.entity).filter(is_hat).collect();
    for hat in &own {
        commands.entity(*hat).insert((Hat, Visibility::Hidden));
    }
    if own.is_empty() {
        // Hair of the head's size, its middle at the origin.
        let (hair, on) = hairs.get(worn.hair)?;
        let felt = materials.add(StandardMaterial {
            perceptual_roughness: 0.9,
            ..Color::srgb(0.12, 0.16, 0.24).into()
        });
        let at = |y: f32| *hair * Transform::from_xyz(0.0, y, 0.01);
        let hat = commands
            .spawn((Hat, Transform::default(), Visibility::Hidden, ChildOf(on.parent())))
            .id();
        for (radius, height, y) in [(0.15, 0.008, 0.085), (0.1, 0.1, 0.13)] {
            let part = Mesh3d(meshes.add(Cylinder::new(radius, height)));
            commands.spawn((part, MeshMaterial3d(felt.clone()), at(y), ChildOf(hat)));
        }
    }
    Ok(())
}

pub fn put_on_hats(keys: Res<ButtonInput<KeyCode>>, mut hats: Query<&mut Visibility, With<Hat>>) {
    if keys.just_pressed(KeyCode::KeyH) {
        hats.iter_mut().for_each(|mut hat| hat.toggle_inherited_hidden());
    }
}
