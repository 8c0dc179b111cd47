//! Forward kinematics and geometric Jacobian of the UR3.

/// Six joint values: angles (rad), velocities (rad/s) or accelerations (rad/s²).
pub type Joints = [f64; 6];

/// A vector in the base frame.
pub type Vector = [f64; 3];

/// Link of the manufacturer's published Denavit-Hartenberg table.
struct Link {
    d: f64,
    a: f64,
    // The twist is a multiple of a quarter turn: its cosine is exactly 0 or 1, which `cos(FRAC_PI_2)` is not.
    sin_alpha: f64,
    cos_alpha: f64,
}

const fn link(d: f64, a: f64, sin_alpha: f64, cos_alpha: f64) -> Link {
    Link { d, a, sin_alpha, cos_alpha }
}

const LINKS: [Link; 6] = [
    link(0.1519, 0.0, 1.0, 0.0),
    link(0.0, -0.24365, 0.0, 1.0),
    link(0.0, -0.21325, 0.0, 1.0),
    link(0.11235, 0.0, 1.0, 0.0),
    link(0.08535, 0.0, -1.0, 0.0),
    link(0.0819, 0.0, 0.0, 1.0),
];

/// Position and orientation of a link in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Columns are the frame's x, y and z axes: `axes[column][row]`.
    pub axes: [Vector; 3],
    /// Origin, m.
    pub position: Vector,
}

impl Frame {
    const BASE: Self = Self { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], position: [0.0; 3] };

    /// The z axis: the joint's rotation axis, and for the last frame the direction in which the tool points.
    pub fn z(&self) -> Vector {
        self.axes[2]
    }

    /// Returns the next frame of the chain: `Rz(theta) Tz(d) Tx(a) Rx(alpha)`.
    fn then(&self, link: &Link, theta: f64) -> Self {
        let (s, c) = (libm::sin(theta), libm::cos(theta));
        let [x, y, z] = self.axes;
        let turned_x = combine(c, x, s, y);
        let turned_y = combine(-s, x, c, y);
        Self {
            axes: [
                turned_x,
                combine(link.cos_alpha, turned_y, link.sin_alpha, z),
                combine(-link.sin_alpha, turned_y, link.cos_alpha, z),
            ],
            position: add(self.position, combine(link.a, turned_x, link.d, z)),
        }
    }
}

/// Computes the frames 0 (base) to 6 (tool) at joint angles `q`.
pub fn chain(q: &Joints) -> [Frame; 7] {
    let mut frames = [Frame::BASE; 7];
    for (i, link) in LINKS.iter().enumerate() {
        frames[i + 1] = frames[i].then(link, q[i]);
    }
    frames
}

/// Computes the tool frame at joint angles `q`.
pub fn tool(q: &Joints) -> Frame {
    chain(q)[6]
}

/// Computes the geometric Jacobian, one entry for each joint: linear (m/rad) and angular (rad/rad) velocity of the
/// tool.
pub fn jacobian(frames: &[Frame; 7]) -> [(Vector, Vector); 6] {
    let tip = frames[6].position;
    core::array::from_fn(|i| {
        let axis = frames[i].z();
        (cross(axis, subtract(tip, frames[i].position)), axis)
    })
}

/// A target position and direction of the tool; the turn about that direction is free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Tool position, m.
    pub position: Vector,
    /// Unit vector for the tool's z axis.
    pub axis: Vector,
}

/// Error of a tool frame with respect to a goal, both parts in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// Goal minus tool position, m.
    pub position: Vector,
    /// Rotation vector (rad) of the shortest turn that brings the tool axis onto the goal axis. Zero for opposite
    /// axes, where no turn is the shortest.
    pub rotation: Vector,
}

/// Computes the error of the tool frame `tool` with respect to `goal`.
pub fn pose_error(tool: &Frame, goal: &Goal) -> PoseError {
    let normal = cross(tool.z(), goal.axis);
    let sine = norm(normal);
    let rotation =
        if sine < 1e-12 { [0.0; 3] } else { scale(normal, libm::atan2(sine, dot(tool.z(), goal.axis)) / sine) };
    PoseError { position: subtract(goal.position, tool.position), rotation }
}

/// Adds two vectors.
pub fn add(a: Vector, b: Vector) -> Vector {
    core::array::from_fn(|i| a[i] + b[i])
}

/// Computes `a - b`.
pub fn subtract(a: Vector, b: Vector) -> Vector {
    core::array::from_fn(|i| a[i] - b[i])
}

/// Multiplies `a` by the number `factor`.
pub fn scale(a: Vector, factor: f64) -> Vector {
    a.map(|x| x * factor)
}

/// Computes the scalar product.
pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Computes the Euclidean length.
pub fn norm(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn combine(p: f64, a: Vector, q: f64, b: Vector) -> Vector {
    core::array::from_fn(|i| p * a[i] + q * b[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::FRAC_PI_2;

    fn assert_close(a: Vector, b: Vector, tolerance: f64) {
        assert!(norm(subtract(a, b)) < tolerance, "{a:?} is not {b:?}");
    }

    #[test]
    fn zero_pose_is_stretched_along_minus_x() {
        let tool = tool(&[0.0; 6]);
        assert_close(tool.position, [-0.24365 - 0.21325, -0.11235 - 0.0819, 0.1519 - 0.08535], 1e-12);
        assert_close(tool.z(), [0.0, -1.0, 0.0], 1e-12);
    }

    #[test]
    fn upright_pose_stacks_the_links() {
        let tool = tool(&[0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, 0.0, 0.0]);
        let height = 0.1519 + 0.24365 + 0.21325 + 0.08535;
        assert_close(tool.position, [0.0, -0.11235 - 0.0819, height], 1e-12);
        assert_close(tool.z(), [0.0, -1.0, 0.0], 1e-12);
    }

    #[test]
    fn bent_pose_points_the_tool_down() {
        let tool = tool(&[0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2, -FRAC_PI_2, 0.0]);
        assert_close(tool.z(), [0.0, 0.0, -1.0], 1e-12);
        assert_close(tool.position, [-0.21325 - 0.08535, -0.11235, 0.1519 + 0.24365 - 0.0819], 1e-12);
    }

    #[test]
    fn jacobian_matches_finite_differences() {
        let q = [0.3, -1.1, 1.4, -1.9, -1.2, 0.7];
        let step = 1e-6;
        for (i, (linear, angular)) in jacobian(&chain(&q)).into_iter().enumerate() {
            let (mut before, mut after) = (q, q);
            before[i] -= step;
            after[i] += step;
            let (before, after) = (tool(&before), tool(&after));
            let slope = |a: Vector, b: Vector| scale(subtract(b, a), 0.5 / step);
            assert_close(linear, slope(before.position, after.position), 1e-8);
            // Every axis of a turning frame moves with angular velocity x axis.
            for column in 0..3 {
                let expected = slope(before.axes[column], after.axes[column]);
                assert_close(cross(angular, tool(&q).axes[column]), expected, 1e-8);
            }
        }
    }

    #[test]
    fn pose_error_is_the_turn_to_the_goal() {
        let tool = Frame::BASE;
        let angle = 0.4;
        let goal = Goal { position: [0.1, 0.0, -0.2], axis: [libm::sin(angle), 0.0, libm::cos(angle)] };
        let error = pose_error(&tool, &goal);
        assert_close(error.position, [0.1, 0.0, -0.2], 1e-15);
        // z turns towards x about y.
        assert_close(error.rotation, [0.0, angle, 0.0], 1e-12);
    }
}
