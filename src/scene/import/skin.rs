//! Skins: vertices that follow joints (glTF 2.0, section 3.7.3).
//!
//! ```text
//! p' = Σ_j w_j M_j p,   M_j = file_from_joint · joint_from_mesh (the inverse bind matrix),   n' = (Σ_j w_j M_j)^−T n
//! ```
//!
//! The joints stand where their nodes do in the file: the bind pose, or the pose that the file was saved in. The place
//! of the mesh's own node does not count. Weights are divided by their sum.

use glam::{DAffine3, DMat3, DMat4};

use super::Warnings;
use super::accessor::Buffers;
use super::json::{Primitive, Skin};
use super::raw::RawMesh;

/// M_j of each joint.
pub(super) struct Pose(Vec<DAffine3>);

impl Pose {
    /// The pose of a skin whose nodes have these places; `None`, counted, if a joint has none.
    pub fn new(
        buffers: &Buffers<'_>,
        skin: &Skin,
        file_from_node: &[Option<DAffine3>],
        warnings: &mut Warnings,
    ) -> Result<Option<Self>, String> {
        let matrices = match skin.inverse_bind_matrices {
            Some(index) => buffers.read::<16>(index)?,
            None => Vec::new(),
        };
        let joints = skin.joints.iter().enumerate().map(|(k, &node)| {
            let place = file_from_node.get(node).copied().flatten()?;
            let from_mesh = match matrices.get(k) {
                Some(columns) => DAffine3::from_mat4(DMat4::from_cols_array(columns)),
                None => DAffine3::IDENTITY,
            };
            Some(place * from_mesh).filter(DAffine3::is_finite)
        });
        let pose: Option<Vec<DAffine3>> = joints.collect();
        if pose.is_none() {
            warnings.count("skins with joints outside of the scene: unposed", 1);
        }
        Ok(pose.map(Self))
    }

    /// Moves a primitive's vertices and normals into the file's frame; vertices without weights go where `place` takes
    /// them.
    pub fn apply(
        &self,
        buffers: &Buffers<'_>,
        primitive: &Primitive,
        place: DAffine3,
        mesh: &mut RawMesh,
        warnings: &mut Warnings,
    ) -> Result<(), String> {
        let a = &primitive.attributes;
        let mut influences: Vec<Vec<([f64; 4], [f64; 4])>> = Vec::new();
        for (joints, weights) in [(a.joints, a.weights), (a.more_joints, a.more_weights)] {
            if let (Some(joints), Some(weights)) = (joints, weights) {
                let (joints, weights) = (buffers.read::<4>(joints)?, buffers.read::<4>(weights)?);
                influences.push(joints.into_iter().zip(weights).collect());
            }
        }
        let (mut loose, mut beyond) = (0, 0);
        for (i, p) in mesh.positions.iter_mut().enumerate() {
            let (mut sum, mut total) = (DMat4::ZERO, 0.0);
            let own = influences.iter().filter_map(|set| set.get(i));
            let own = own.flat_map(|(joints, weights)| joints.iter().zip(weights));
            for (&joint, &weight) in own.filter(|(_, weight)| **weight > 0.0) {
                // The cast saturates: what is no number of a joint is beyond them.
                match self.0.get(joint as usize) {
                    Some(m) => {
                        sum += DMat4::from(*m) * weight;
                        total += weight;
                    }
                    None => beyond += 1,
                }
            }
            let m = match total > 0.0 {
                true => DAffine3::from_mat4(sum * total.recip()),
                false => {
                    loose += 1;
                    place
                }
            };
            *p = m.transform_point3(*p);
            if let Some(n) = mesh.normals.get_mut(i) {
                *n = cofactors(m.matrix3) * *n;
            }
        }
        warnings.count("vertices of skins that no joint moves", loose);
        warnings.count(
            "joints of vertices that their skin does not have: left out",
            beyond,
        );
        Ok(())
    }
}

/// The inverse transpose times the determinant's size: normals keep their side, and a flattened place is no division by
/// zero.
fn cofactors(m: DMat3) -> DMat3 {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
    let side = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * side
}
