//! What scenes from glTF files need to know.

use bevy::{
    animation::{AnimatedBy, AnimationTargetId},
    camera::{
        primitives::Aabb,
        visibility::{DynamicSkinnedMeshBounds, NoFrustumCulling, VisibilityClass},
    },
    gltf::{GltfMaterialName, GltfMeshName, GltfSceneName},
    mesh::skinning::SkinnedMesh,
    prelude::*,
    transform::components::TransformTreeChanged,
};

/// What glTF scenes are made of.
pub fn register(app: &mut App) {
    app.register_type::<Transform>()
        .register_type::<GlobalTransform>()
        .register_type::<TransformTreeChanged>()
        .register_type::<Visibility>()
        .register_type::<InheritedVisibility>()
        .register_type::<ViewVisibility>()
        .register_type::<VisibilityClass>()
        .register_type::<DynamicSkinnedMeshBounds>()
        .register_type::<NoFrustumCulling>()
        .register_type::<Aabb>()
        .register_type::<Name>()
        .register_type::<Children>()
        .register_type::<ChildOf>()
        .register_type::<Mesh3d>()
        .register_type::<MeshMaterial3d<StandardMaterial>>()
        .register_type::<SkinnedMesh>()
        .register_type::<GltfSceneName>()
        .register_type::<GltfMaterialName>()
        .register_type::<GltfMeshName>()
        .register_type::<AnimationPlayer>()
        .register_type::<AnimationTargetId>()
        .register_type::<AnimatedBy>();
}
