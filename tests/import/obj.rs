//! OBJ and MTL with pictures beside them.

use std::fs;

use quadpixel::scene::import::import;
use quadpixel::scene::world::{Alpha, World};

const OBJ: &str = "mtllib my lib.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                   usemtl leaf\nf 1/1 2/2 3/3 4/4\nusemtl gone\nf 1 2 3\nusemtl water\nf 1 3 4\n";
const MTL: &str = "newmtl leaf\nKd 0.5 1 0.25\nKs 0 0 0\nmap_Kd pictures\\leaf.png\nmap_d pictures/mask.png\n\
                   newmtl water\nillum 7\nNi 1.33\nKd 0 0 0\n";

fn write(folder: &std::path::Path) {
    fs::create_dir(folder.join("pictures")).unwrap();
    fs::write(folder.join("a.obj"), OBJ).unwrap();
    fs::write(folder.join("my lib.mtl"), MTL).unwrap();
    let red = image::RgbImage::from_pixel(4, 2, image::Rgb([255, 0, 0]));
    red.save(folder.join("pictures/leaf.png")).unwrap();
    let mask = image::GrayImage::from_fn(2, 1, |x, _| image::Luma([if x == 0 { 255 } else { 0 }]));
    mask.save(folder.join("pictures/mask.png")).unwrap();
}

#[test]
fn parts_materials_pictures_and_masks_come_together() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let scene = import(&folder.path().join("a.obj"), Some(10.0)).unwrap();
    let world = &scene.world;
    assert_eq!(world.meshes.len(), 3);
    assert_eq!(world.instances[0].camera_from_mesh.matrix3.x_axis.x, 10.0);
    // v is turned round: the first corner, at OBJ's (0, 0), is the picture's lower left.
    assert_eq!(world.meshes[0].uvs.as_ref().unwrap()[0], [0.0, 1.0]);
    let leaf = &world.materials[0];
    assert_eq!((leaf.base_colour, leaf.ior), ([0.5, 1.0, 0.25], 1.0));
    assert!(matches!(leaf.alpha, Alpha::Mask { .. }));
    let map = &world.textures[leaf.base_colour_texture.unwrap().texture];
    assert_eq!(map.sample([0.125, 0.25], 0.0), [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(map.sample([0.875, 0.25], 0.0), [1.0, 0.0, 0.0, 0.0]);
    let water = &world.materials[2];
    assert_eq!((water.transmission, water.ior), (1.0, 1.33));
    let warnings = scene.warnings.to_string();
    assert_eq!(
        warnings,
        "1× material \"gone\" is not defined: grey instead"
    );
    World::new(scene.world).unwrap();
}

#[test]
fn a_missing_picture_is_counted_and_named() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    fs::remove_file(folder.path().join("pictures/leaf.png")).unwrap();
    fs::remove_file(folder.path().join("my lib.mtl")).unwrap();
    let scene = import(&folder.path().join("a.obj"), None).unwrap();
    assert!(scene.warnings.to_string().contains("my lib.mtl"));
    fs::write(folder.path().join("my lib.mtl"), MTL).unwrap();
    let scene = import(&folder.path().join("a.obj"), None).unwrap();
    let warnings = scene.warnings.to_string();
    assert!(warnings.contains("leaf.png"), "{warnings}");
    assert!(scene.world.materials[0].base_colour_texture.is_none());
}
