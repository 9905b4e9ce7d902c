use kilauea_math::Vec2;

/// Where a density lives, charted by the unit square.
pub trait Domain {
    /// A point of the domain.
    type Point: Copy;

    /// The point at coordinates in [0, 1]², and the measure of the domain per unit of area there.
    fn point(&self, at: [f64; 2]) -> (Self::Point, f64);

    /// Coordinates of a point; none outside of the domain.
    fn coordinates(&self, point: Self::Point) -> Option<[f64; 2]>;
}

/// A rectangle of the plane.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    /// Lower corner.
    pub min: Vec2,
    /// Upper corner.
    pub max: Vec2,
}

impl Domain for Rectangle {
    type Point = Vec2;

    fn point(&self, at: [f64; 2]) -> (Vec2, f64) {
        let (min, size) = (self.min.as_dvec2(), (self.max - self.min).as_dvec2());
        let point = min + size * kilauea_math::DVec2::from_array(at);
        (point.as_vec2(), size.x * size.y)
    }

    fn coordinates(&self, point: Vec2) -> Option<[f64; 2]> {
        let at = (point - self.min).as_dvec2() / (self.max - self.min).as_dvec2();
        let is_inside = at.min_element() >= 0.0 && at.max_element() <= 1.0;
        is_inside.then_some(at.to_array())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_chart_themselves() {
        let domain = Rectangle {
            min: Vec2::new(-1.0, 2.0),
            max: Vec2::new(3.0, 2.5),
        };
        let (point, measure) = domain.point([0.25, 0.5]);
        assert_eq!((point, measure), (Vec2::new(0.0, 2.25), 2.0));
        assert_eq!(domain.coordinates(point), Some([0.25, 0.5]));
        assert_eq!(domain.coordinates(Vec2::ZERO), None);
    }
}
