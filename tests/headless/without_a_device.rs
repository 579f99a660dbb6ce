//! Without a renderer the plugin does nothing, and breaks nothing.

use crate::common::{one_strand, test_app};
use bevy::{
    asset::AssetPlugin,
    prelude::*,
    render::{RenderPlugin, settings::WgpuSettings},
};
use bevy_keratin::{prelude::*, render::HairBuffers};
use std::sync::{Arc, Mutex};

#[test]
fn minimal_plugins_draw_nothing_and_panic_nowhere() {
    let mut app = test_app(60.0);
    let (hair, _) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
    crate::common::run(&mut app, 0.2);
    assert!(app.world().get::<HairBuffers>(hair).is_none());
    app.world_mut().despawn(hair);
    crate::common::run(&mut app, 0.1);
}

#[test]
fn assets_without_a_renderer_are_fine() {
    for hair_first in [true, false] {
        let mut app = App::new();
        if hair_first {
            app.add_plugins((HairPlugins::default(), MinimalPlugins, AssetPlugin::default()));
        } else {
            app.add_plugins((MinimalPlugins, AssetPlugin::default(), HairPlugins::default()));
        }
        let (hair, _) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
        app.finish();
        app.cleanup();
        app.update();
        assert!(app.world().get::<HairBuffers>(hair).is_none());
    }
}

#[test]
fn a_renderer_without_a_device_is_fine() {
    for hair_first in [true, false] {
        let render = RenderPlugin {
            render_creation: WgpuSettings { backends: None, ..default() }.into(),
            ..default()
        };
        let bevy = DefaultPlugins
            .set(render)
            .disable::<bevy::winit::WinitPlugin>()
            .disable::<bevy::log::LogPlugin>();
        let mut app = App::new();
        if hair_first {
            app.add_plugins((HairPlugins::default(), bevy));
        } else {
            app.add_plugins((bevy, HairPlugins::default()));
        }
        let (hair, _) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
        let reported = Reported::default();
        tracing::subscriber::with_default(reported.clone(), || {
            app.finish();
            app.cleanup();
            for _ in 0..3 {
                app.update();
            }
        });
        assert!(app.world().get::<Strands>(hair).is_some());
        let reported = reported.0.lock().unwrap();
        assert_eq!(reported.len(), 1, "one message: {reported:?}");
        assert!(reported[0].contains("no graphics device"), "{reported:?}");
    }
}

/// What the crate has logged.
#[derive(Clone, Default)]
pub(crate) struct Reported(pub(crate) Arc<Mutex<Vec<String>>>);

impl tracing::field::Visit for Reported {
    fn record_debug(&mut self, _: &tracing::field::Field, value: &dyn core::fmt::Debug) {
        self.0.lock().unwrap().push(format!("{value:?}"));
    }
}

impl tracing::Subscriber for Reported {
    fn enabled(&self, metadata: &tracing::Metadata<'_>) -> bool {
        metadata.is_event() && metadata.target().starts_with("bevy_keratin")
    }
    fn event(&self, event: &tracing::Event<'_>) {
        event.record(&mut self.clone());
    }
    fn new_span(&self, _: &tracing::span::Attributes<'_>) -> tracing::span::Id {
        tracing::span::Id::from_u64(1)
    }
    fn record(&self, _: &tracing::span::Id, _: &tracing::span::Record<'_>) {}
    fn record_follows_from(&self, _: &tracing::span::Id, _: &tracing::span::Id) {}
    fn enter(&self, _: &tracing::span::Id) {}
    fn exit(&self, _: &tracing::span::Id) {}
}
