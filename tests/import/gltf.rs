//! Where the parts of a glTF file land: metres to mm, frames, materials, pictures, lights.

use glam::{DAffine3, DVec3};
use quadpixel::scene::import::{Imported, bounds_mm, import_bytes, placed};
use quadpixel::scene::world::{Alpha, Light, World};

use crate::glb;

fn imported() -> Imported {
    import_bytes(&glb::valid(), false, "small.glb").unwrap()
}

fn near(a: DVec3, b: DVec3) {
    assert!((a - b).length() < 1e-3, "{a} is not {b}");
}

#[test]
fn metres_become_mm_and_nodes_multiply() {
    let scene = imported();
    assert_eq!(scene.warnings.to_string(), "");
    let world = &scene.world;
    assert_eq!((world.meshes.len(), world.instances.len()), (2, 2));
    let corner = |instance: usize, vertex: usize| {
        let instance = &world.instances[instance];
        let p = world.meshes[instance.mesh].positions_mm[vertex];
        instance
            .camera_from_mesh
            .transform_point3(DVec3::from(p.map(f64::from)))
    };
    // A quarter turn about y takes x to −z; then the node's place, then mm.
    near(corner(0, 1), DVec3::new(1000.0, 1500.0, 2500.0));
    // The child is twice as large, and its third corner is the sparse one.
    near(corner(1, 2), DVec3::new(1500.0, 3000.0, 2000.0));
    // A fan of four corners.
    assert_eq!(world.meshes[1].triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!([0, 1], [0, 1].map(|i| world.instances[i].object_id));
    World::new(scene.world).unwrap();
}

#[test]
fn the_camera_looks_along_minus_z_of_its_node() {
    let scene = imported();
    let camera = &scene.cameras[0];
    assert_eq!(camera.name, "eye");
    near(camera.file_from_camera.translation, DVec3::Z * 5000.0);
    assert!((camera.vertical_deg.unwrap() - 0.5f64.to_degrees()).abs() < 1e-9);
    // In the camera's frame the square's middle, at (1, 2, 3) m, is 2 m before the lens.
    let world = placed(scene.world, camera.file_from_camera.inverse());
    near(
        world.instances[0].camera_from_mesh.translation,
        DVec3::new(1000.0, 2000.0, -2000.0),
    );
    let (low, high) = bounds_mm(&world).unwrap();
    assert!(low.z >= -5000.0 && high.z <= 0.0, "{low} {high}");
}

#[test]
fn materials_and_pictures_are_those_of_the_file() {
    let world = imported().world;
    let [paint, glass] = world.materials.as_slice() else {
        panic!("two materials");
    };
    assert_eq!(paint.base_colour, [0.5, 0.25, 1.0]);
    assert_eq!((paint.metallic, paint.roughness), (0.0, 0.4));
    assert_eq!(
        paint.alpha,
        Alpha::Mask {
            alpha: 1.0,
            cutoff: 0.5
        }
    );
    assert!(paint.two_sided && paint.emission == [0.1, 0.0, 0.0]);
    assert_eq!(
        (glass.transmission, glass.ior, glass.thin_walled),
        (1.0, 1.33, false)
    );
    let reference = paint.base_colour_texture.unwrap();
    // Scaled by 2, turned by 0.1 rad counter-clockwise as seen (v down), moved by a quarter.
    let uv = reference.uv_from_mesh.transform_point2(glam::Vec2::X);
    assert!((uv.x - (0.25 + 2.0 * 0.1f32.cos())).abs() < 1e-6);
    assert!((uv.y + 2.0 * 0.1f32.sin()).abs() < 1e-6);
    let map = &world.textures[reference.texture];
    assert_eq!(map.size(), (2, 2));
    // Code 15 of sRGB is 0.0048 linear; alpha code 63 is 0.247.
    let [r, _, _, a] = map.sample([0.25, 0.25], 0.0);
    assert!((r - 0.004777).abs() < 1e-5 && (a - 63.0 / 255.0).abs() < 1e-6);
    // The upper left texel is at the small v: glTF's v runs down, as ours does.
    let uvs = world.meshes[0].uvs.as_ref().unwrap();
    assert_eq!(uvs[3], [0.0, 0.0]);
}

#[test]
fn lights_keep_their_units_and_scale_with_the_world() {
    let world = imported().world;
    let [point, sun, spot] = world.lights.as_slice() else {
        panic!("three lights");
    };
    let Light::Point {
        position_mm,
        intensity_m2,
    } = point
    else {
        panic!("{point:?}")
    };
    near(*position_mm, DVec3::new(0.0, 4000.0, 0.0));
    assert_eq!(*intensity_m2, [2.0, 1.0, 0.0]);
    // The parent's matrix takes z to y: what points along −z in the node points down.
    let Light::Sun { direction, .. } = sun else {
        panic!("{sun:?}")
    };
    near(*direction, -DVec3::Y);
    assert!(
        matches!(spot, Light::Spot { outer_deg, .. } if (outer_deg - 0.2f64.to_degrees()).abs() < 1e-9)
    );
    // At half the size everything is lit alike if the intensity goes with the square.
    let half = placed(world, DAffine3::from_scale(DVec3::splat(0.5)));
    let Light::Point { intensity_m2, .. } = &half.lights[0] else {
        panic!()
    };
    assert_eq!(*intensity_m2, [0.5, 0.25, 0.0]);
}

#[test]
fn a_million_nodes_and_a_hundred_thousand_primitives_are_read_in_seconds() {
    let list = |entry: &str, n: usize| vec![entry; n].join(",");
    let began = std::time::Instant::now();
    // One triangle: the corners (0, 0, 0), (1, 0, 0), (0, 1, 0).
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
        "nodes": [{{"mesh": 0, "children": [{children}]}}, {nodes}],
        "meshes": [{{"primitives": [{primitives}]}}],
        "buffers": [{{"byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}}]}}"#,
        children = (1..=1_000_000)
            .map(|k| k.to_string())
            .collect::<Vec<_>>()
            .join(","),
        nodes = list(r#"{"translation": [1, 0, 0]}"#, 1_000_000),
        primitives = list(r#"{"attributes": {"POSITION": 0}}"#, 100_000),
    );
    let scene = import_bytes(text.as_bytes(), false, "many.gltf").unwrap();
    assert_eq!(scene.world.instances.len(), 100_000);
    assert_eq!(World::new(scene.world).unwrap().triangles(), 1);
    assert!(began.elapsed().as_secs() < 40, "{:?}", began.elapsed());
}
