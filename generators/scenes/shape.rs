//! Surfaces built from their equations, mm, y up, and the solids of a toy box.
//!
//! A patch is a map (u, v) ∈ [0, 1]² → point, sampled on a grid; normals are ∂p/∂u × ∂p/∂v by central differences of
//! the map itself, turned outwards by the caller's choice of direction. Triangles run counter-clockwise seen from their
//! front.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3};
use quadpixel::scene::world::{MaterialIndices, TriangleMesh};

/// Triangles under construction.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub uvs: Vec<DVec2>,
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// A patch of `nu` × `nv` cells over the map; its front is the side of ∂p/∂u × ∂p/∂v.
    pub fn patch(nu: usize, nv: usize, at: impl Fn(f64, f64) -> DVec3) -> Self {
        let mut shape = Self::default();
        let step = 1e-4;
        for j in 0..=nv {
            for i in 0..=nu {
                let (u, v) = (i as f64 / nu as f64, j as f64 / nv as f64);
                let (u0, u1) = ((u - step).max(0.0), (u + step).min(1.0));
                let (v0, v1) = ((v - step).max(0.0), (v + step).min(1.0));
                let normal = |v: f64| {
                    let across = at(u1, v) - at(u0, v);
                    across.cross(at(u, v1) - at(u, v0)).try_normalize()
                };
                // At a pole one derivative is zero; a little inside it is not.
                let inside = v + (0.5 - v) * 1e-3;
                shape.positions.push(at(u, v));
                shape
                    .normals
                    .push(normal(v).or_else(|| normal(inside)).unwrap_or(DVec3::Y));
                shape.uvs.push(DVec2::new(u, 1.0 - v));
            }
        }
        let row = nu as u32 + 1;
        for j in 0..nv as u32 {
            for i in 0..nu as u32 {
                let a = j * row + i;
                shape.push([a, a + 1, a + row + 1]);
                shape.push([a, a + row + 1, a + row]);
            }
        }
        shape
    }

    /// Adds a triangle unless two of its corners are one point (the tip of a cone).
    fn push(&mut self, t: [u32; 3]) {
        let [a, b, c] = t.map(|i| self.positions[i as usize]);
        let apart = |a: DVec3, b: DVec3| (a - b).length_squared() > 1e-18;
        if apart(a, b) && apart(b, c) && apart(c, a) {
            self.triangles.push(t);
        }
    }

    /// Both together.
    pub fn with(mut self, other: &Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.uvs.extend(&other.uvs);
        let shifted = other.triangles.iter().map(|t| t.map(|i| i + first));
        self.triangles.extend(shifted);
        self
    }

    /// Moved by a transform that does not mirror.
    pub fn moved(mut self, by: DAffine3) -> Self {
        let of_normals: DMat3 = by.matrix3.inverse().transpose();
        for p in &mut self.positions {
            *p = by.transform_point3(*p);
        }
        for n in &mut self.normals {
            *n = (of_normals * *n).normalize_or_zero();
        }
        self
    }

    /// Shifted.
    pub fn at(self, offset: DVec3) -> Self {
        self.moved(DAffine3::from_translation(offset))
    }

    /// The volume it encloses, if it is closed: Σ a · (b × c)/6 (the divergence theorem); positive when its fronts are
    /// outside.
    #[cfg(test)]
    pub fn volume(&self) -> f64 {
        let corners = self
            .triangles
            .iter()
            .map(|t| t.map(|i| self.positions[i as usize]));
        corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    /// As the world has it.
    pub fn into_mesh(self, name: &str) -> TriangleMesh {
        let three = |v: &[DVec3]| v.iter().map(|p| p.as_vec3().to_array()).collect();
        TriangleMesh {
            name: name.to_string(),
            positions_mm: three(&self.positions),
            normals: Some(three(&self.normals)),
            uvs: Some(self.uvs.iter().map(|p| p.as_vec2().to_array()).collect()),
            triangles: self.triangles,
            materials: MaterialIndices::Mesh(0),
            ..TriangleMesh::default()
        }
    }
}

/// A flat rectangle around the origin in the plane z = 0, facing +z; u to the right, v down.
pub(super) fn rectangle(width: f64, height: f64) -> Shape {
    Shape::patch(1, 1, |u, v| {
        DVec3::new((u - 0.5) * width, (v - 0.5) * height, 0.0)
    })
}

/// A box around the origin.
pub(super) fn cuboid(size: DVec3) -> Shape {
    let half = 0.5 * size;
    let face = |turn: DMat3, w: f64, h: f64, d: f64| {
        rectangle(w, h)
            .at(DVec3::Z * d)
            .moved(DAffine3::from_mat3(turn))
    };
    let about_y = |quarter: f64| DMat3::from_rotation_y(quarter * 0.5 * PI);
    let about_x = |quarter: f64| DMat3::from_rotation_x(quarter * 0.5 * PI);
    face(DMat3::IDENTITY, size.x, size.y, half.z)
        .with(&face(about_y(1.0), size.z, size.y, half.x))
        .with(&face(about_y(2.0), size.x, size.y, half.z))
        .with(&face(about_y(3.0), size.z, size.y, half.x))
        .with(&face(about_x(1.0), size.x, size.z, half.y))
        .with(&face(about_x(3.0), size.x, size.z, half.y))
}

/// A sphere around the origin.
pub(super) fn sphere(radius: f64, cells: usize) -> Shape {
    Shape::patch(2 * cells, cells, |u, v| {
        let (sin, cos) = (TAU * u).sin_cos();
        // Exactly zero at the poles, so that their triangles close.
        let ring = if v == 0.0 || v == 1.0 {
            0.0
        } else {
            (PI * v).sin()
        };
        radius * DVec3::new(ring * sin, -(PI * v).cos(), ring * cos)
    })
}

/// A torus around y: a tube of radius `minor` along a circle of radius `major`.
pub(super) fn torus(major: f64, minor: f64, cells: usize) -> Shape {
    Shape::patch(2 * cells, cells, |u, v| {
        let (sin, cos) = (TAU * u).sin_cos();
        let (up, out) = (TAU * v).sin_cos();
        let ring = major + minor * out;
        DVec3::new(ring * sin, minor * up, ring * cos)
    })
}

/// A surface of revolution about y: `profile` lists (radius, height) from below to above along its outside; a corner
/// that is to be sharp is listed twice.
pub(super) fn lathe(profile: &[(f64, f64)], cells: usize) -> Shape {
    let mut shape = Shape::default();
    for part in profile.chunk_by(|a, b| a != b) {
        if part.len() < 2 {
            continue;
        }
        let spans = (part.len() - 1) as f64;
        let patch = Shape::patch(cells, part.len() - 1, |u, v| {
            let x = v * spans;
            let k = (x as usize).min(part.len() - 2);
            let f = x - k as f64;
            let r = part[k].0 + f * (part[k + 1].0 - part[k].0);
            let y = part[k].1 + f * (part[k + 1].1 - part[k].1);
            let (sin, cos) = (TAU * u).sin_cos();
            DVec3::new(r * sin, y, r * cos)
        });
        shape = shape.with(&patch);
    }
    shape
}

/// A closed cylinder on the plane y = 0.
pub(super) fn cylinder(radius: f64, height: f64, cells: usize) -> Shape {
    let (low, high) = ((radius, 0.0), (radius, height));
    lathe(&[(0.0, 0.0), low, low, high, high, (0.0, height)], cells)
}

/// A closed cone on the plane y = 0.
pub(super) fn cone(radius: f64, height: f64, cells: usize) -> Shape {
    lathe(
        &[(0.0, 0.0), (radius, 0.0), (radius, 0.0), (0.0, height)],
        cells,
    )
}

/// A regular solid of 20 flat faces around the origin, corners at `radius`.
pub(super) fn icosahedron(radius: f64) -> Shape {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut corners = Vec::with_capacity(12);
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        let p = DVec3::new(0.0, a, b);
        corners.extend([p, DVec3::new(p.y, p.z, 0.0), DVec3::new(p.z, 0.0, p.y)]);
    }
    let scale = radius / (1.0 + g * g).sqrt();
    let mut shape = Shape::default();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [i, j, k].map(|n| corners[n]);
                // The edges of this solid are 2 long.
                let edge = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
                if !(edge(a, b) && edge(b, c) && edge(c, a)) {
                    continue;
                }
                let outwards = (b - a).cross(c - a).dot(a) > 0.0;
                let [b, c] = if outwards { [b, c] } else { [c, b] };
                let normal = (b - a).cross(c - a).normalize();
                let first = shape.positions.len() as u32;
                shape.positions.extend([a, b, c].map(|p| p * scale));
                shape.normals.extend([normal; 3]);
                let uv = [DVec2::ZERO, DVec2::X, DVec2::new(0.5, 0.9)];
                shape.uvs.extend(uv);
                shape.triangles.push([first, first + 1, first + 2]);
            }
        }
    }
    shape
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The polyhedron of n cells a turn has the area n/2 sin(2π/n) of its circle; relative excess of the circle's.
    fn circle_defect(cells: f64) -> f64 {
        1.0 - (TAU / cells).sin() * cells / TAU
    }

    #[test]
    fn closed_solids_enclose_their_volumes_with_fronts_outside() {
        let n = 64usize;
        let allowed = 2.0 * circle_defect(n as f64);
        for (name, shape, exact) in [
            ("box", cuboid(DVec3::new(1.0, 2.0, 3.0)), 6.0),
            ("sphere", sphere(2.0, n), 4.0 / 3.0 * PI * 8.0),
            ("torus", torus(3.0, 1.0, n), 2.0 * PI * PI * 3.0),
            ("cylinder", cylinder(1.0, 2.0, n), 2.0 * PI),
            ("cone", cone(1.0, 3.0, n), PI),
            ("icosahedron", icosahedron(1.0), 2.536_150_7),
        ] {
            let ratio = shape.volume() / exact;
            assert!((ratio - 1.0).abs() < allowed, "{name}: {ratio}");
        }
    }

    #[test]
    fn normals_agree_with_the_fronts_of_their_triangles() {
        for shape in [
            cuboid(DVec3::ONE),
            sphere(1.0, 24),
            torus(2.0, 0.5, 24),
            cone(1.0, 1.0, 24),
            icosahedron(1.0),
        ] {
            for t in &shape.triangles {
                let [a, b, c] = t.map(|i| shape.positions[i as usize]);
                let front = (b - a).cross(c - a).normalize();
                for n in t.map(|i| shape.normals[i as usize]) {
                    assert!(front.dot(n) > 0.5, "{front} {n}");
                }
            }
        }
    }
}
