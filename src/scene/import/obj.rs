//! Wavefront OBJ and MTL text: the polygons, their materials' names, and the materials.
//!
//! Positions, normals, texture coordinates, faces (fans of triangles; negative indices count from the end), `usemtl`,
//! `mtllib`; lines, points, curves and smoothing groups are passed over. Read by our own few lines because a ready
//! reader (tobj 4.0.5) panics at a line such as `Kd 0.5`.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::raw::RawMesh;
use super::{MAX_TRIANGLES, Warnings};

/// What an OBJ file holds, in its own unit.
#[derive(Debug, Default)]
pub(super) struct Obj {
    /// One mesh a material name (`None`: before any `usemtl`), in the order of first use.
    pub parts: Vec<(Option<String>, RawMesh)>,
    /// Names after `mtllib`.
    pub libraries: Vec<String>,
}

/// The MTL statements that have a counterpart here.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mtl {
    pub diffuse: Option<[f64; 3]>,
    pub specular: Option<[f64; 3]>,
    pub emission: Option<[f64; 3]>,
    pub shininess: Option<f64>,
    pub dissolve: Option<f64>,
    pub index_of_refraction: Option<f64>,
    pub illumination: Option<u32>,
    pub roughness: Option<f64>,
    pub metallic: Option<f64>,
    pub diffuse_map: Option<String>,
    pub dissolve_map: Option<String>,
    pub emission_map: Option<String>,
}

/// Index triple of a corner, from 0.
type Corner = (usize, Option<usize>, Option<usize>);

#[derive(Default)]
struct Part {
    mesh: RawMesh,
    known: BTreeMap<Corner, u32>,
    has_uvs: bool,
    has_normals: bool,
}

/// Reads OBJ text. A line that cannot be read is an error that names it; `Err` holds the line's number and what is
/// wrong.
pub(super) fn read_obj(text: &str, warnings: &mut Warnings) -> Result<Obj, (usize, String)> {
    let (mut points, mut uvs, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    let mut parts: Vec<(Option<String>, Part)> = Vec::new();
    let mut of_name: BTreeMap<Option<String>, usize> = BTreeMap::new();
    let mut material: Option<String> = None;
    let mut libraries = Vec::new();
    let mut triangles = 0;
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_whitespace();
        let keyword = words.next().unwrap_or_default();
        let rest = line
            .trim_start()
            .strip_prefix(keyword)
            .unwrap_or_default()
            .trim();
        let at_line = |what: String| (index + 1, what);
        match keyword {
            "v" => points.push(DVec3::from(numbers(rest).map_err(at_line)?)),
            "vn" => normals.push(DVec3::from(numbers(rest).map_err(at_line)?)),
            "vt" => {
                // One coordinate alone is allowed.
                let [u] = numbers(rest).map_err(at_line)?;
                let [_, v] = numbers(rest).unwrap_or([u, 0.0]);
                uvs.push(DVec2::new(u, v));
            }
            "f" => {
                let sizes = (points.len(), uvs.len(), normals.len());
                let corners: Vec<Corner> = words
                    .map(|w| corner(w, sizes))
                    .collect::<Result<_, _>>()
                    .map_err(at_line)?;
                if corners.len() < 3 {
                    warnings.count("faces of fewer than three corners: dropped", 1);
                    continue;
                }
                triangles += corners.len() - 2;
                if triangles > MAX_TRIANGLES {
                    return Err(at_line(format!("more than {MAX_TRIANGLES} triangles")));
                }
                let number = *of_name.entry(material.clone()).or_insert_with(|| {
                    parts.push((material.clone(), Part::default()));
                    parts.len() - 1
                });
                let part = &mut parts[number].1;
                let ids: Vec<u32> = corners
                    .into_iter()
                    .map(|c| part.vertex(c, &points, &uvs, &normals))
                    .collect();
                for k in 1..ids.len() - 1 {
                    part.mesh.triangles.push([ids[0], ids[k], ids[k + 1]]);
                }
            }
            "usemtl" => material = (!rest.is_empty()).then(|| rest.to_string()),
            "mtllib" => libraries.push(rest.to_string()),
            _ => {}
        }
    }
    let parts = parts
        .into_iter()
        .map(|(name, part)| (name, part.finished()))
        .collect();
    Ok(Obj { parts, libraries })
}

impl Part {
    fn vertex(
        &mut self,
        corner: Corner,
        points: &[DVec3],
        uvs: &[DVec2],
        normals: &[DVec3],
    ) -> u32 {
        if let Some(&id) = self.known.get(&corner) {
            return id;
        }
        let (p, t, n) = corner;
        let look_up = |i: Option<usize>, of: &[DVec3]| i.and_then(|i| of.get(i).copied());
        let mesh = &mut self.mesh;
        let id = mesh.positions.len() as u32;
        // A position out of range stays NaN, so that cleaning drops and counts its triangles.
        mesh.positions
            .push(look_up(Some(p), points).unwrap_or(DVec3::NAN));
        mesh.normals
            .push(look_up(n, normals).unwrap_or(DVec3::ZERO));
        mesh.uvs
            .push(t.and_then(|t| uvs.get(t).copied()).unwrap_or(DVec2::ZERO));
        self.has_uvs |= t.is_some();
        self.has_normals |= n.is_some();
        self.known.insert(corner, id);
        id
    }

    fn finished(mut self) -> RawMesh {
        if !self.has_uvs {
            self.mesh.uvs.clear();
        }
        if !self.has_normals {
            self.mesh.normals.clear();
        }
        self.mesh
    }
}

/// Reads MTL text: materials by name. Statements without a counterpart here are passed over; broken numbers are
/// counted.
pub(super) fn read_mtl(text: &str, warnings: &mut Warnings) -> BTreeMap<String, Mtl> {
    let mut materials: BTreeMap<String, Mtl> = BTreeMap::new();
    let mut current = None;
    let mut broken = 0;
    for line in text.lines() {
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if keyword == "newmtl" {
            current = Some(rest.to_string());
            materials.entry(rest.to_string()).or_default();
        }
        let Some(m) = current.as_ref().and_then(|name| materials.get_mut(name)) else {
            continue;
        };
        let mut number = || match numbers::<1>(rest) {
            Ok([value]) => Some(value),
            Err(_) => {
                broken += 1;
                None
            }
        };
        match keyword {
            "Ns" => m.shininess = number(),
            "d" => m.dissolve = number(),
            "Tr" => m.dissolve = number().map(|t| 1.0 - t),
            "Ni" => m.index_of_refraction = number(),
            "illum" => m.illumination = number().map(|i| i as u32),
            "Pr" => m.roughness = number(),
            "Pm" => m.metallic = number(),
            // A single number stands for all three.
            "Kd" | "Ks" | "Ke" => {
                let alone = rest.split_whitespace().nth(1).is_none();
                let colour = match numbers::<3>(rest) {
                    Err(_) if alone => number().map(|grey| [grey; 3]),
                    Err(_) => {
                        broken += 1;
                        None
                    }
                    Ok(colour) => Some(colour),
                };
                match keyword {
                    "Kd" => m.diffuse = colour,
                    "Ks" => m.specular = colour,
                    _ => m.emission = colour,
                }
            }
            "map_Kd" => m.diffuse_map = Some(map_name(rest)),
            "map_d" => m.dissolve_map = Some(map_name(rest)),
            "map_Ke" => m.emission_map = Some(map_name(rest)),
            _ => {}
        }
    }
    warnings.count("MTL statements with a broken number: passed over", broken);
    materials
}

/// The file of a map statement: what follows its options (`-s 1 1 1 -bm 0.2 file name.png`).
fn map_name(rest: &str) -> String {
    let mut rest = rest;
    while rest.starts_with('-') {
        let after = rest.split_once(char::is_whitespace).map_or("", |(_, r)| r);
        rest = after.trim_start();
        while let Some((word, after)) = rest.split_once(char::is_whitespace) {
            if word.parse::<f64>().is_err() && word != "on" && word != "off" {
                break;
            }
            rest = after.trim_start();
        }
    }
    rest.to_string()
}

/// The first N numbers of a line.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let mut out = [0.0; N];
    let mut words = text.split_whitespace();
    for o in &mut out {
        *o = words
            .next()
            .and_then(|w| w.parse().ok())
            .ok_or_else(|| format!("`{}`: {N} numbers expected", excerpt(text)))?;
    }
    Ok(out)
}

/// `p`, `p/t`, `p//n` or `p/t/n`, from 1 or, negative, from the end.
fn corner(word: &str, (points, uvs, normals): (usize, usize, usize)) -> Result<Corner, String> {
    let broken = || {
        format!(
            "`{}` is no face corner; allowed: p, p/t, p//n, p/t/n",
            excerpt(word)
        )
    };
    let mut parts = word.split('/');
    let mut next = |count: usize| -> Result<Option<usize>, String> {
        match parts.next() {
            None | Some("") => Ok(None),
            Some(text) => {
                let i: i64 = text.parse().map_err(|_| broken())?;
                let from_zero = if i < 0 {
                    (count as i64).checked_add(i)
                } else {
                    i.checked_sub(1)
                };
                // What is out of range (0, before the first) points nowhere, and its triangle is dropped later.
                Ok(Some(
                    from_zero
                        .and_then(|i| usize::try_from(i).ok())
                        .unwrap_or(usize::MAX),
                ))
            }
        }
    };
    let p = next(points)?.ok_or_else(broken)?;
    Ok((p, next(uvs)?, next(normals)?))
}

fn excerpt(text: &str) -> String {
    text.chars().take(60).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn polygons_become_fans_and_negative_indices_count_from_the_end() {
        let text = "mtllib a b.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 # note\nvt 0.5\nvn 0 0 1\n\
                    f 1 2 3 4\nusemtl my red\nf -4/1/1 -3/1/1 -2/1/1\nf 1 2\nf 1 2 99\n";
        let mut warnings = Warnings::default();
        let obj = read_obj(text, &mut warnings).unwrap();
        assert_eq!(obj.libraries, ["a b.mtl"]);
        assert_eq!(obj.parts.len(), 2);
        assert_eq!(obj.parts[0].1.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!(obj.parts[0].1.uvs.is_empty());
        let (name, mesh) = &obj.parts[1];
        assert_eq!(name.as_deref(), Some("my red"));
        assert_eq!(mesh.triangles.len(), 2);
        assert_eq!(
            (mesh.uvs[0], mesh.normals[0]),
            (DVec2::new(0.5, 0.0), DVec3::Z)
        );
        let mut mesh = mesh.clone();
        mesh.clean(&mut warnings);
        assert_eq!(mesh.triangles.len(), 1, "the corner 99 does not exist");
    }

    #[test]
    fn a_broken_line_is_named() {
        for (text, line) in [("v 0 0\n", 1), ("\nf 1 a 2\n", 2), ("v 1 2 x", 1)] {
            let error = read_obj(text, &mut Warnings::default()).unwrap_err();
            assert_eq!(error.0, line, "{error:?}");
        }
    }

    #[test]
    fn materials_are_read_with_their_maps_and_options() {
        let text = "newmtl a\nKd 0.5\nNs 10\nmap_Kd -s 1 1 1 -clamp on my wood.png\nnewmtl b\nTr 0.25\nKe 1 2 x\nNi\n";
        let mut warnings = Warnings::default();
        let m = read_mtl(text, &mut warnings);
        assert_eq!(m["a"].diffuse, Some([0.5; 3]));
        assert_eq!(m["a"].diffuse_map.as_deref(), Some("my wood.png"));
        assert_eq!(m["b"].dissolve, Some(0.75));
        assert_eq!(m["b"].emission, None);
        assert_eq!(warnings.iter().map(|(_, n)| n).sum::<u64>(), 2);
    }
}
