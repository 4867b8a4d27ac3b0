//! Vertex colours, morph targets and skins of glTF files, against places and light worked out by hand.

use glam::DVec3;
use quadpixel::scene::import::{Imported, import_bytes};
use quadpixel::scene::world::{PathKey, PathSettings, World};
use serde_json::{Value, json};

use crate::glb;

/// A triangle (0, 0, 0), (1, 0, 0), (0, 2, 0), three times a corner of colour, joint and weight: (bytes, buffer views,
/// accessors).
fn parts() -> (Vec<u8>, Vec<Value>, Vec<Value>) {
    let (mut bytes, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    let mut add = |part: Vec<u8>, component: u32, count: usize, shape: &str, normalized: bool| {
        views.push(json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": part.len()}));
        accessors.push(json!({"bufferView": views.len() - 1, "componentType": component, "count": count, "type": shape,
            "normalized": normalized}));
        bytes.extend(part);
    };
    let floats = |v: &[f32]| -> Vec<u8> { v.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0];
    add(floats(&corners), 5126, 3, "VEC3", false);
    // 1: normals along y, 2: a morph target that lifts the third corner by 1, 3: colours.
    add(floats(&[0.0, 1.0, 0.0].repeat(3)), 5126, 3, "VEC3", false);
    let lift = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    add(floats(&lift), 5126, 3, "VEC3", false);
    let colours = vec![255, 0, 51, 255, 0, 255, 51, 255, 0, 0, 51, 255];
    add(colours, 5121, 3, "VEC4", true);
    // 4, 5: the first corner on joint 0, the second on both alike (weights 3 and 3), the third on joint 1.
    add(
        vec![0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0],
        5121,
        3,
        "VEC4",
        false,
    );
    let weights = [1.0, 0.0, 0.0, 0.0, 3.0, 3.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    add(floats(&weights), 5126, 3, "VEC4", false);
    // 6: inverse bind matrices: the identity, and 1 down in y.
    let mut bind = [
        1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
    ]
    .repeat(2);
    bind[29] = -1.0;
    add(floats(&bind), 5126, 2, "MAT4", false);
    (bytes, views, accessors)
}

/// The triangle with these attributes (beside positions) and further fields of its primitive, mesh and node.
fn imported(attributes: Value, primitive: Value, mesh: Value, node: Value) -> Imported {
    let (bytes, views, accessors) = parts();
    let with = |mut base: Value, more: Value| {
        let more = more.as_object().unwrap().clone();
        base.as_object_mut().unwrap().extend(more);
        base
    };
    let primitive = with(
        json!({"attributes": with(json!({"POSITION": 0}), attributes), "material": 0}),
        primitive,
    );
    let document = json!({
        "asset": {"version": "2.0"},
        // The joint turns by a quarter about z, 1 above its parent, which stands at the root.
        "nodes": [with(json!({"mesh": 0}), node), {"children": [2]},
            {"translation": [0.0, 1.0, 0.0], "rotation": [0.0, 0.0, 0.5f64.sqrt(), 0.5f64.sqrt()]}],
        "meshes": [with(json!({"primitives": [primitive]}), mesh)],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": 6}, {"joints": [1, 77]}, {"joints": [1]}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorFactor": [1.0, 0.5, 1.0, 1.0]},
            "extensions": {"KHR_materials_ior": {"ior": 1.0}}}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": bytes.len()}],
    });
    import_bytes(
        &glb::container_of(document.to_string().into_bytes(), bytes),
        false,
        "posed.glb",
    )
    .unwrap()
}

/// Where the corners of an instance are, m.
fn corners(scene: &Imported, instance: usize) -> Vec<DVec3> {
    let instance = &scene.world.instances[instance];
    let positions = &scene.world.meshes[instance.mesh].positions_mm;
    let place = |p: &[f32; 3]| {
        instance
            .camera_from_mesh
            .transform_point3(DVec3::from(p.map(f64::from)))
    };
    positions.iter().map(|p| place(p) / 1000.0).collect()
}

fn near(a: DVec3, b: [f64; 3]) {
    assert!((a - DVec3::from(b)).length() < 1e-6, "{a} is not {b:?}");
}

#[test]
fn a_skin_moves_corners_with_the_joints_and_not_with_its_node() {
    let skinned = json!({"NORMAL": 1, "JOINTS_0": 4, "WEIGHTS_0": 5});
    let node = json!({"skin": 0, "translation": [5.0, 5.0, 5.0]});
    let scene = imported(skinned, json!({}), json!({}), node);
    assert_eq!(scene.warnings.to_string(), "");
    let at = corners(&scene, 0);
    // Joint 1 takes p to (0, 1, 0) + turned (p − (0, 1, 0)): x to y, y to −x.
    near(at[0], [0.0, 0.0, 0.0]);
    near(at[2], [-1.0, 1.0, 0.0]);
    // Half of (1, 0, 0) and half of (1, 2, 0).
    near(at[1], [1.0, 1.0, 0.0]);
    let normals = scene.world.meshes[0].normals.as_ref().unwrap();
    let normal = |i: usize| DVec3::from(normals[i].map(f64::from)).normalize();
    near(normal(0), [0.0, 1.0, 0.0]);
    near(normal(1), [-0.5f64.sqrt(), 0.5f64.sqrt(), 0.0]);
    near(normal(2), [-1.0, 0.0, 0.0]);
}

#[test]
fn what_a_skin_lacks_is_counted_and_the_mesh_stays_in_its_place() {
    let skinned = json!({"JOINTS_0": 4, "WEIGHTS_0": 5});
    let node = |skin: usize| json!({"skin": skin, "translation": [5.0, 0.0, 0.0]});
    let unposed = imported(skinned.clone(), json!({}), json!({}), node(1));
    assert!(
        unposed
            .warnings
            .to_string()
            .contains("1× skins with joints outside")
    );
    near(corners(&unposed, 0)[2], [5.0, 2.0, 0.0]);
    // The third skin has one joint: the second corner keeps its share, the third has none.
    let short = imported(skinned, json!({}), json!({}), node(2));
    let said = short.warnings.to_string();
    assert!(
        said.contains("1× vertices of skins that no joint moves"),
        "{said}"
    );
    assert!(
        said.contains("2× joints of vertices that their skin does not have"),
        "{said}"
    );
    near(corners(&short, 0)[1], [1.0, 0.0, 0.0]);
    near(corners(&short, 0)[2], [5.0, 2.0, 0.0]);
}

#[test]
fn morph_targets_have_the_weights_of_their_node_or_else_their_mesh() {
    let targets = || json!({"targets": [{"POSITION": 2}]});
    let third =
        |mesh: Value, node: Value| corners(&imported(json!({}), targets(), mesh, node), 0)[2];
    near(third(json!({}), json!({})), [0.0, 2.0, 0.0]);
    near(third(json!({"weights": [0.5]}), json!({})), [0.0, 2.0, 0.5]);
    near(
        third(json!({"weights": [0.5]}), json!({"weights": [-2.0]})),
        [0.0, 2.0, -2.0],
    );
    let coloured = json!({"targets": [{"POSITION": 2, "COLOR_0": 3}]});
    let scene = imported(json!({}), coloured, json!({"weights": [1.0]}), json!({}));
    assert!(
        scene
            .warnings
            .to_string()
            .contains("1× morph targets of texture coordinates or colours")
    );
}

#[test]
fn light_has_the_interpolated_colour_of_the_vertices() {
    let scene = imported(json!({"COLOR_0": 3}), json!({}), json!({}), json!({}));
    assert_eq!(scene.warnings.to_string(), "");
    let mut world = scene.world;
    assert_eq!(
        world.meshes[0].colours.as_ref().unwrap()[0],
        [1.0, 0.0, 0.2, 1.0]
    );
    // A diffuse surface under an even sky of 1 sends back its reflectance, whatever direction is drawn.
    world.environment = quadpixel::scene::world::Environment::Even([1.0; 3]);
    let world = World::new(world).unwrap();
    let key = PathKey {
        key: 1,
        number: 0,
        spread: 0.0,
    };
    // Weights 1/2, 1/4, 1/4 of the corners.
    let origin = DVec3::new(250.0, 500.0, 100.0);
    let l = world.radiance_along(origin, -DVec3::Z, &PathSettings::default(), &key);
    for (l, expected) in l.into_iter().zip([0.5, 0.5 * 0.25, 0.2]) {
        assert!((l - expected).abs() < 1e-5, "{l} is not {expected}");
    }
}
