//! Lights of three kinds, cameras.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use serde_json::json;

use crate::{Builder, good, warns};
use lampyris::math::{DVec3, cos};
use lampyris::photometry::Colour;
use lampyris::scene::Light;

/// The light of a node with `transform`.
fn light(light: serde_json::Value, mut node: serde_json::Value) -> (Light, Vec<String>) {
    let mut builder = Builder::new();
    builder.light(light);
    node["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    builder.node(node);
    let model = good(&builder);
    (model.lights[0].clone(), model.warnings)
}

#[test]
fn a_point_light_has_its_colour_times_its_candela() {
    let written = json!({ "type": "point", "intensity": 79.577_471_545_947_67, "color": [1.0, 0.5, 0.0] });
    let (light, warnings) = light(written, json!({ "translation": [0.1, 2.0, 3.0], "scale": [5.0, 5.0, 5.0] }));
    let intensity = Colour([1.0, 0.5, 0.0]) * 79.577_471_545_947_67;
    assert_eq!(light, Light::Omni { position: DVec3::new(0.1, 2.0, 3.0), intensity });
    assert!(warnings.is_empty());
}

#[test]
fn a_spot_looks_along_minus_z_of_its_node() {
    let half = 0.5f64.sqrt();
    let written = json!({ "type": "spot", "intensity": 3.0, "range": 4.0, "spot": { "innerConeAngle": 0.2 } });
    // A quarter turn about X takes -Z to +Y.
    let (light, warnings) = light(written, json!({ "rotation": [half, 0.0, 0.0, half], "scale": [2.0, 2.0, 7.0] }));
    let Light::Spot { direction, inner, outer, intensity, .. } = light else { panic!("not a spot") };
    assert!((direction - DVec3::Y).length() < 1e-15);
    assert_eq!((inner, outer, intensity), (0.2, FRAC_PI_4, Colour::grey(3.0)));
    assert!(warnings[0].contains("`range` is ignored"));
}

#[test]
fn a_hemispherical_spot_written_in_single_precision_is_accepted() {
    let angle = f64::from(FRAC_PI_2 as f32);
    let written = json!({ "type": "spot", "spot": { "innerConeAngle": 0.1, "outerConeAngle": angle } });
    let (light, _) = light(written, json!({}));
    assert!(matches!(light, Light::Spot { outer, .. } if outer == FRAC_PI_2));
}

#[test]
fn a_spot_with_equal_cones_gets_the_edge_of_the_implementation_note() {
    let written = json!({ "type": "spot", "spot": { "innerConeAngle": 0.5, "outerConeAngle": 0.5 } });
    let (light, warnings) = light(written, json!({}));
    let Light::Spot { inner, outer, .. } = light else { panic!("not a spot") };
    assert!(inner < outer && (cos(inner) - cos(outer) - 1e-3).abs() < 1e-12);
    assert!(warnings[0].contains("equal cone angles"));
}

#[test]
fn a_directional_light_has_lux_and_a_direction() {
    let (light, _) = light(json!({ "type": "directional", "intensity": 500.0 }), json!({}));
    assert_eq!(light, Light::Directional { direction: DVec3::NEG_Z, illuminance: Colour::grey(500.0) });
}

/// A builder with one perspective camera.
fn with_camera() -> Builder {
    let mut builder = Builder::new();
    let perspective = json!({ "yfov": 0.7, "aspectRatio": 1.5, "znear": 0.1 });
    builder.push("/cameras", json!({ "name": "lens", "type": "perspective", "perspective": perspective }));
    builder
}

#[test]
fn a_camera_keeps_its_direction_and_loses_scale_shear_and_mirroring() {
    let half = 0.5f64.sqrt();
    let mut builder = with_camera();
    // Turned by 90 degrees about Y: looks along -X. The parent is mirrored in X, so it looks along +X.
    builder.node(json!({ "children": [1], "scale": [-2.0, 3.0, 4.0] }));
    builder.node(
        json!({ "name": "view", "camera": 0, "rotation": [0.0, half, 0.0, half], "translation": [1.0, 1.0, 1.0] }),
    );
    let model = good(&builder);
    let camera = &model.cameras[0];
    assert_eq!((camera.name.as_str(), camera.yfov, camera.aspect), ("view", 0.7, Some(1.5)));
    assert_eq!(camera.eye, DVec3::new(-2.0, 3.0, 4.0));
    assert!((camera.up - DVec3::Y).length() < 1e-15 && (camera.right - DVec3::Z).length() < 1e-15);
}

#[test]
fn a_camera_under_shear_is_orthonormal() {
    let mut builder = with_camera();
    builder.node(json!({ "children": [1], "scale": [1.0, 4.0, 1.0] }));
    builder.node(json!({ "camera": 0, "rotation": [0.2, 0.3, 0.1, 0.927_361_849_5] }));
    let camera = &good(&builder).cameras[0];
    assert!((camera.right.length() - 1.0).abs() < 1e-15 && (camera.up.length() - 1.0).abs() < 1e-15);
    assert!(camera.right.dot(camera.up).abs() < 1e-15);
}

#[test]
fn cameras_are_named_by_node_then_camera_then_number() {
    let mut builder = with_camera();
    builder.push("/cameras", json!({ "type": "perspective", "perspective": { "yfov": 1.0 } }));
    builder.node(json!({ "name": "north", "camera": 0 }));
    builder.node(json!({ "camera": 0 }));
    builder.node(json!({ "camera": 1 }));
    builder.node(json!({ "name": "north", "camera": 1 }));
    let model = good(&builder);
    let names: Vec<_> = model.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(names, ["north", "lens", "camera2", "north"]);
    assert!(warns(&model, "two cameras are called `north`"));
}

#[test]
fn an_orthographic_camera_is_left_out_with_a_warning() {
    let mut builder = Builder::new();
    let orthographic = json!({ "xmag": 1.0, "ymag": 1.0, "zfar": 9.0, "znear": 0.1 });
    builder.push("/cameras", json!({ "type": "orthographic", "orthographic": orthographic }));
    builder.node(json!({ "name": "plan", "camera": 0 }));
    let model = good(&builder);
    assert!(model.cameras.is_empty() && warns(&model, "camera `plan` is orthographic"));
}
