//! A small valid GLB, written here byte by byte: a textured square metre, a glass triangle fan, a camera and three
//! lights.

use std::io::Cursor;

use serde_json::{Value, json};

/// The binary chunk: (bytes, buffer views).
fn binary() -> (Vec<u8>, Vec<Value>) {
    let mut bytes = Vec::new();
    let mut views = Vec::new();
    let mut add = |part: Vec<u8>| {
        while bytes.len() % 4 != 0 {
            bytes.push(0u8);
        }
        views.push(json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": part.len()}));
        bytes.extend(part);
    };
    let floats = |v: &[f32]| -> Vec<u8> { v.iter().flat_map(|x| x.to_le_bytes()).collect() };
    // 0: corners of a square of 1 m in z = 0, facing +z; 1: texture coordinates; 2: indices.
    add(floats(&[
        -0.5, -0.5, 0.0, 0.5, -0.5, 0.0, 0.5, 0.5, 0.0, -0.5, 0.5, 0.0,
    ]));
    add(floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
    add([0u16, 1, 2, 0, 2, 3]
        .iter()
        .flat_map(|i| i.to_le_bytes())
        .collect());
    // 3, 4: a sparse replacement of corner 2; 5: a picture of 2×2.
    add(vec![2]);
    add(floats(&[0.5, 0.5, 0.25]));
    let mut png = Cursor::new(Vec::new());
    image::RgbaImage::from_raw(2, 2, (0..16).map(|i| 16 * i + 15).collect())
        .unwrap()
        .write_to(&mut png, image::ImageFormat::Png)
        .unwrap();
    add(png.into_inner());
    (bytes, views)
}

/// The JSON document.
pub fn document() -> Value {
    let (bytes, views) = binary();
    json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_transmission", "KHR_materials_ior"],
        "scene": 0,
        "scenes": [{"nodes": [0, 2, 3]}],
        "nodes": [
            {"name": "turned", "translation": [1.0, 2.0, 3.0], "rotation": [0.0, (0.5f64.sqrt()), 0.0, (0.5f64.sqrt())],
             "children": [1], "mesh": 0},
            {"mesh": 1, "scale": [2.0, 2.0, 2.0]},
            {"name": "eye", "translation": [0.0, 0.0, 5.0], "camera": 0},
            {"matrix": [1,0,0,0, 0,0,-1,0, 0,1,0,0, 0,4,0,1], "children": [4, 5],
             "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"extensions": {"KHR_lights_punctual": {"light": 1}}},
            {"extensions": {"KHR_lights_punctual": {"light": 2}}}
        ],
        "meshes": [
            {"name": "square", "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]},
            {"primitives": [{"attributes": {"POSITION": 3}, "mode": 6, "material": 1}]}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "sparse": {"count": 1,
             "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 4}}}
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": bytes.len()}],
        "materials": [
            {"name": "paint", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1.0, 1.0], "metallicFactor": 0.0,
             "roughnessFactor": 0.4, "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform":
             {"offset": [0.25, 0.0], "scale": [2.0, 2.0], "rotation": 0.1}}}}, "emissiveFactor": [0.1, 0.0, 0.0],
             "alphaMode": "MASK", "doubleSided": true},
            {"pbrMetallicRoughness": {"roughnessFactor": 0.0, "metallicFactor": 0.0}, "extensions": {
             "KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": 1.33},
             "KHR_materials_volume": {"thicknessFactor": 0.1}}}
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071}],
        "images": [{"bufferView": 5, "mimeType": "image/png"}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "point", "intensity": 2.0, "color": [1.0, 0.5, 0.0]},
            {"type": "directional", "intensity": 3.0},
            {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}}
        ]}}
    })
}

/// A GLB of a document and the binary chunk.
pub fn container(document: &Value) -> Vec<u8> {
    container_of(document.to_string().into_bytes(), binary().0)
}

/// The parts of the valid file.
pub fn parts() -> [Vec<u8>; 2] {
    [document().to_string().into_bytes(), binary().0]
}

/// A GLB of any two chunks, with the right lengths.
pub fn container_of(mut json: Vec<u8>, mut bin: Vec<u8>) -> Vec<u8> {
    while !json.len().is_multiple_of(4) {
        json.push(b' ');
    }
    while !bin.len().is_multiple_of(4) {
        bin.push(0);
    }
    let length = 12 + 8 + json.len() + 8 + bin.len();
    let mut glb = b"glTF".to_vec();
    for word in [2, length as u32, json.len() as u32] {
        glb.extend(word.to_le_bytes());
    }
    glb.extend(b"JSON");
    glb.extend(json);
    glb.extend((bin.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(bin);
    glb
}

/// The valid file.
pub fn valid() -> Vec<u8> {
    container(&document())
}
