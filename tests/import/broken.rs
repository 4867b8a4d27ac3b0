//! Files that make no sense: a clear error that names the place, or a counted warning.

use std::fs;

use quadpixel::scene::import::{ImportError, MAX_FILE_BYTES, import, import_bytes};
use quadpixel::scene::world::World;
use serde_json::{Value, json};

use crate::glb;

/// The outcome of the valid document after a change: warnings or the error's text.
fn after(change: impl Fn(&mut Value)) -> Result<String, String> {
    let mut document = glb::document();
    change(&mut document);
    let scene =
        import_bytes(&glb::container(&document), false, "a.glb").map_err(|e| e.to_string())?;
    let warnings = scene.warnings.to_string();
    World::new(scene.world).map_err(|e| e.to_string())?;
    Ok(warnings)
}

#[test]
fn what_makes_no_sense_is_refused_by_its_place() {
    type Change = fn(&mut Value);
    let cases: [(&str, Change); 12] = [
        ("asset.version", |d| d["asset"]["version"] = json!("1.0")),
        ("extensionsRequired", |d| {
            d["extensionsRequired"] = json!(["KHR_draco_mesh_compression"])
        }),
        ("nodes[0]", |d| d["nodes"][1]["children"] = json!([0])),
        ("nodes[99]", |d| d["scenes"][0]["nodes"] = json!([99])),
        ("mesh 7", |d| d["nodes"][0]["mesh"] = json!(7)),
        ("accessor 0", |d| {
            d["accessors"][0]["count"] = json!(5_000_000_000u64)
        }),
        ("accessor 3", |d| {
            d["accessors"][3]["sparse"]["values"]["bufferView"] = json!(3)
        }),
        ("bufferView 0", |d| {
            d["bufferViews"][0]["byteOffset"] = json!(u64::MAX)
        }),
        ("buffers[0]", |d| {
            d["buffers"][0]["byteLength"] = json!(1u64 << 40)
        }),
        ("material 5", |d| {
            d["meshes"][0]["primitives"][0]["material"] = json!(5)
        }),
        ("light 9", |d| {
            d["nodes"][3]["extensions"]["KHR_lights_punctual"]["light"] = json!(9)
        }),
        ("accessors[0].count", |d| {
            d["accessors"][0]["count"] = json!(-4)
        }),
    ];
    for (place, change) in cases {
        let error = after(change).unwrap_err();
        assert!(
            error.contains(place) && error.contains("a.glb"),
            "{place}: {error}"
        );
    }
}

#[test]
fn nothing_but_padding_may_follow_the_document() {
    let with = |tail: &[u8]| {
        let [mut json, bin] = glb::parts();
        json.extend(tail);
        import_bytes(&glb::container_of(json, bin), false, "a.glb").map_err(|e| e.to_string())
    };
    for padding in [&b""[..], b" \n ", b"\0\0\0"] {
        assert!(with(padding).is_ok(), "{padding:?}");
    }
    for text in [&b"}"[..], b"{}", b"\0{}"] {
        let error = with(text).unwrap_err();
        assert!(error.contains("after the document"), "{error}");
    }
}

#[test]
fn what_can_be_left_out_is_counted() {
    type Change = fn(&mut Value);
    let cases: [(&str, Change); 6] = [
        ("texture 0 left out", |d| {
            d["images"][0] = json!({"uri": "missing.png"})
        }),
        ("texture 0 left out", |d| {
            d["bufferViews"][5]["byteLength"] = json!(20)
        }),
        ("points, lines", |d| {
            d["meshes"][0]["primitives"][0]["mode"] = json!(1)
        }),
        ("scaled to nothing", |d| {
            d["nodes"][1]["scale"] = json!([0.0, 1.0, 1.0])
        }),
        ("TEXCOORD_0", |d| {
            d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(1);
        }),
        // The first three of the indices are read as one 32-bit number, which is no vertex.
        ("index out of range", |d| {
            d["accessors"][2] =
                json!({"bufferView": 2, "componentType": 5125, "count": 3, "type": "SCALAR"});
        }),
    ];
    for (what, change) in cases {
        let warnings = after(change).unwrap();
        assert!(warnings.contains(what), "{what}: {warnings}");
    }
}

#[test]
fn vertices_that_are_not_numbers_cost_their_triangles_only() {
    let mut glb = glb::valid();
    // The corner that the sparse accessor puts in.
    let corner: Vec<u8> = [0.5f32, 0.5, 0.25]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let at = glb.windows(12).position(|w| w == corner).unwrap();
    glb[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let scene = import_bytes(&glb, false, "a.glb").unwrap();
    assert!(
        scene
            .warnings
            .to_string()
            .contains("2× triangles with a corner that is not finite")
    );
    assert_eq!(scene.world.meshes.len(), 1);
}

#[test]
fn a_file_of_two_gigabytes_is_refused_before_it_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.glb", "a.obj"] {
        let path = folder.path().join(name);
        // Sparse: takes no room on the disk.
        fs::File::create(&path).unwrap().set_len(2 << 30).unwrap();
        let began = std::time::Instant::now();
        let error = import(&path, None).unwrap_err();
        assert!(
            matches!(error, ImportError::TooLarge { bytes, limit, .. } if bytes == 2 << 30 && limit == MAX_FILE_BYTES)
        );
        assert!(began.elapsed().as_secs_f64() < 0.5);
    }
}

#[test]
fn lengths_of_buffers_are_held_to_the_files_and_to_memory_before_one_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let read = |buffers: Vec<Value>| {
        let path = folder.path().join("a.gltf");
        let document = json!({ "asset": { "version": "2.0" }, "buffers": buffers });
        fs::write(&path, document.to_string()).unwrap();
        let began = std::time::Instant::now();
        let answer = import(&path, None).map(drop).map_err(|e| e.to_string());
        (answer, began.elapsed().as_secs_f64())
    };
    // Sparse, 1 GiB, under four hundred names: together more than any machine of today has.
    let large = folder.path().join("large.bin");
    fs::File::create(&large).unwrap().set_len(1 << 30).unwrap();
    let name = |k: usize| format!("{k}.bin");
    for k in 0..400 {
        fs::hard_link(&large, folder.path().join(name(k))).unwrap();
    }
    let buffer = |uri: String, length: u64| json!({ "uri": uri, "byteLength": length });
    let (answer, seconds) = read((0..400).map(|k| buffer(name(k), 16)).collect());
    let text = answer.unwrap_err();
    assert!(
        text.contains("buffers") && text.contains("GB of memory"),
        "{text}"
    );
    assert!(seconds < 2.0, "{seconds} s");
    // One longer than its file says so at once, though it is the last.
    let small = folder.path().join("small.bin");
    fs::write(&small, [0; 100]).unwrap();
    let (answer, _) = read(vec![buffer(name(0), 16), buffer("small.bin".into(), 101)]);
    let text = answer.unwrap_err();
    assert!(
        text.contains("buffers[1]: has 100 bytes, byteLength says 101"),
        "{text}"
    );
    // One file forty times, by its name and by others of its names, is read once.
    let names = ["small.bin", "./small.bin", "sm%61ll.bin"];
    let forty = (0..40).map(|k| buffer(names[k % 3].into(), 100));
    read(forty.collect()).0.unwrap();
}

#[test]
fn other_files_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.fbx");
    fs::write(&path, b"x").unwrap();
    for (path, part) in [
        (path, "gltf, glb, obj"),
        (folder.path().join("no.glb"), "no.glb"),
    ] {
        let error = import(&path, None).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    for bytes in [&b""[..], b"glTF", b"{", b"glTF\x02\0\0\0\xff\xff\xff\xff"] {
        assert!(import_bytes(bytes, false, "a").is_err());
    }
}
