//! Thousands of damaged copies of a valid file: the importer answers with a world or an error, never a panic, and what
//! it calls a world does not make [`World::new`] panic either (one in forty is tried: preparing takes far longer than
//! reading).
//!
//! `QUADPIXEL_MUTATIONS` sets the number of copies of each kind (default 4000).

use quadpixel::scene::import::{bounds_mm, import_bytes};
use quadpixel::scene::world::World;

use crate::damage::damaged;
use crate::glb;

fn copies() -> u64 {
    let asked = std::env::var("QUADPIXEL_MUTATIONS").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(4000)
}

fn survive(copy: impl Fn(u64) -> Vec<u8>, is_obj: bool) -> (u64, u64) {
    let (mut worlds, mut errors) = (0, 0);
    for key in 0..copies() {
        match import_bytes(&copy(key), is_obj, "damaged") {
            Ok(scene) => {
                bounds_mm(&scene.world);
                worlds += 1;
                // Preparing a world for rays takes far longer than reading it: one in forty.
                if worlds % 40 == 0 {
                    let _ = World::new(scene.world);
                }
            }
            Err(_) => errors += 1,
        }
    }
    (worlds, errors)
}

#[test]
fn damaged_glb_files_never_panic() {
    let valid = glb::valid();
    let [json, bin] = glb::parts();
    // The whole file, or one chunk within an envelope that fits.
    let copy = |key: u64| match key % 3 {
        0 => damaged(&valid, key),
        1 => glb::container_of(damaged(&json, key), bin.clone()),
        _ => glb::container_of(json.clone(), damaged(&bin, key)),
    };
    let (worlds, errors) = survive(copy, false);
    // Both outcomes occur, or the damages would test one path only.
    assert!(
        worlds > copies() / 20 && errors > copies() / 20,
        "{worlds} {errors}"
    );
}

#[test]
fn damaged_gltf_text_never_panics() {
    let mut document = glb::document();
    // Without a binary chunk: the buffer as a data URI of 4 × 256 letters.
    document["buffers"][0] = serde_json::json!({"byteLength": 700,
        "uri": format!("data:application/octet-stream;base64,{}", "AACAPwAA".repeat(128))});
    let text = document.to_string();
    survive(|key| damaged(text.as_bytes(), key), false);
}

#[test]
fn damaged_obj_files_never_panic() {
    let text = "mtllib a.mtl\no thing\nv 0 0 0\nv 1 0 0.5\nv 1 1 0 1 0 0\nv 0 1e0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n\
                usemtl a\nf 1/1/1 2/2/1 3/3/1 4//1\nf -1 -2 -3\nusemtl b\nl 1 2\ng other\nf 1 2 3\n";
    let (worlds, errors) = survive(|key| damaged(text.as_bytes(), key), true);
    assert!(
        worlds > copies() / 20 && errors > copies() / 20,
        "{worlds} {errors}"
    );
}
