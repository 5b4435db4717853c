#include "collision/features.hpp"

#include "collision/hull.hpp"

#include <algorithm>

namespace cairn {
namespace {

constexpr Real kLevel = 1e-3;  // sin of the lean below which a cylinder stands flat: rim points at fixed places

int box_axis(const PlacedShape& s, const Vec3& d, bool& positive) {
    const Vec3 local = s.X_WS.R.transpose() * d;
    int axis = 0;
    local.cwiseAbs().maxCoeff(&axis);
    positive = local[axis] > 0;
    return axis;
}

void box_face(const PlacedShape& s, const Vec3& d, Face& face) {
    bool positive = true;
    const int k = box_axis(s, d, positive);
    const Vec3& h = s.shape->half_extents;
    const Mat3& R = s.X_WS.R;
    face.normal = positive ? Vec3(R.col(k)) : Vec3(-R.col(k));
    const Vec3 centre = s.X_WS.p + h[k] * face.normal;
    face.offset = face.normal.dot(centre);
    face.index = 2 * k + (positive ? 0 : 1);
    face.disc_radius = 0;
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const Vec3 u = h[i] * R.col(i);
    const Vec3 v = positive ? Vec3(h[j] * R.col(j)) : Vec3(-h[j] * R.col(j));
    face.outline.count = 0;
    face.outline.add(centre - u - v, 0);
    face.outline.add(centre + u - v, 1);
    face.outline.add(centre + u + v, 2);
    face.outline.add(centre - u + v, 3);
}

// Among the faces that hold a vertex farthest along d.
int hull_lowest_face_index(const ConvexHull& hull, const Vec3& d_S) {
    int best = -1;
    Real farthest = 0;
    for (const int i : hull.faces_of(hull.support(d_S))) {
        const Real x = d_S.dot(hull.faces()[i].normal);
        if (best < 0 || x > farthest) best = i, farthest = x;
    }
    return best;
}

void hull_face(const PlacedShape& s, int index, Face& face) {
    const ConvexHull& hull = *s.shape->hull;
    face.index = index;
    face.disc_radius = 0;
    const ConvexHull::Face& f = hull.faces()[face.index];
    face.normal = s.X_WS.R * f.normal;
    face.offset = f.offset + face.normal.dot(s.X_WS.p);
    face.outline.count = 0;
    const int taken = std::min(f.count, kMaxOutline);
    for (int i = 0; i < taken; ++i) {
        const int vertex = hull.loop()[f.first + i * f.count / taken];
        face.outline.add(s.X_WS * hull.vertices()[vertex], static_cast<std::uint8_t>(i));
    }
}

// The cap as a polygon of 32 rim points: at fixed places while the cylinder stands flat, else from the point farthest along d.
void cylinder_cap(const PlacedShape& s, const Vec3& d, const Lean& lean, Face& face) {
    struct Circle {
        Real c[kMaxOutline], s[kMaxOutline];
        Circle() {
            for (int i = 0; i < kMaxOutline; ++i) {
                c[i] = std::cos(2 * kPi * i / kMaxOutline);
                s[i] = std::sin(2 * kPi * i / kMaxOutline);
            }
        }
    };
    static const Circle circle;
    const Mat3& R = s.X_WS.R;
    const bool top = lean.cos > 0;
    face.normal = top ? Vec3(R.col(2)) : Vec3(-R.col(2));
    const Vec3 centre = s.X_WS.p + s.shape->half_height * face.normal;
    face.offset = face.normal.dot(centre);
    face.index = top ? 0 : 1;
    face.disc_radius = s.shape->radius;
    face.disc_centre = centre;
    Vec3 u = R.col(0);
    if (lean.sin > kLevel) u = (d - lean.cos * R.col(2)) / lean.sin;
    const Vec3 v = face.normal.cross(u);
    face.outline.count = 0;
    for (int i = 0; i < kMaxOutline; ++i)
        face.outline.add(centre + s.shape->radius * (circle.c[i] * u + circle.s[i] * v), static_cast<std::uint8_t>(i));
}

// The second lowest corner of a convex polytope is next to the lowest one.
AxisSegment hull_edge(const PlacedShape& s, const Vec3& n) {
    const ConvexHull& hull = *s.shape->hull;
    const std::vector<Vec3>& vertices = hull.vertices();
    const Vec3 down = -(s.X_WS.R.transpose() * n);
    const int from = hull.support(down);
    int to = from;
    Real lowest = 0;
    for (const int neighbour : hull.neighbours(from)) {
        const Real low = down.dot(vertices[neighbour]);
        if (to == from || low > lowest) lowest = low, to = neighbour;
    }
    return {{s.X_WS * vertices[from], s.X_WS * vertices[to]}, 0};
}

}  // namespace

Real shape_size(const Shape& s) {
    switch (s.type) {
        case ShapeType::kSphere:
            return s.radius;
        case ShapeType::kBox:
            return s.half_extents.norm();
        case ShapeType::kCapsule:
            return s.radius + s.half_height;
        case ShapeType::kCylinder:
            return std::sqrt(s.radius * s.radius + s.half_height * s.half_height);
        case ShapeType::kHull:
            return s.hull->outer_radius();
        default:
            return 0;
    }
}

Real inner_radius(const Shape& s) {
    switch (s.type) {
        case ShapeType::kSphere:
        case ShapeType::kCapsule:
            return s.radius;
        case ShapeType::kBox:
            return s.half_extents.minCoeff();
        case ShapeType::kCylinder:
            return std::min(s.radius, s.half_height);
        case ShapeType::kHull:
            return s.hull->inner_radius();
        default:
            return 0;
    }
}

Vec3 centre_of(const PlacedShape& s) {
    return s.shape->type == ShapeType::kHull ? s.X_WS * s.shape->hull->centroid() : s.X_WS.p;
}

Lean lean_of(const PlacedShape& s, const Vec3& n) {
    const Vec3 z = s.X_WS.R.col(2);
    const Real c = z.dot(n);
    return {c, (n - c * z).norm()};
}

Vec3 support_point(const PlacedShape& s, const Vec3& d) {
    const Shape& shape = *s.shape;
    const Transform& X = s.X_WS;
    switch (shape.type) {
        case ShapeType::kSphere:
            return X.p + shape.radius * d;
        case ShapeType::kBox: {
            const Vec3 local = X.R.transpose() * d;
            Vec3 corner;
            for (int k = 0; k < 3; ++k) corner[k] = local[k] > 0 ? shape.half_extents[k] : -shape.half_extents[k];
            return X * corner;
        }
        case ShapeType::kCapsule: {
            const Vec3 z = X.R.col(2);
            return X.p + (z.dot(d) > 0 ? shape.half_height : -shape.half_height) * z + shape.radius * d;
        }
        case ShapeType::kCylinder: {
            const Vec3 z = X.R.col(2);
            const Lean lean = lean_of(s, d);
            Vec3 p = X.p + (lean.cos > 0 ? shape.half_height : -shape.half_height) * z;
            if (lean.sin > 1e-12) p += (shape.radius / lean.sin) * (d - lean.cos * z);
            return p;
        }
        case ShapeType::kHull:
            return X * shape.hull->vertices()[shape.hull->support(X.R.transpose() * d)];
        default:
            return X.p;
    }
}

Real support(const PlacedShape& s, const Vec3& d) {
    const Shape& shape = *s.shape;
    const Transform& X = s.X_WS;
    switch (shape.type) {
        case ShapeType::kSphere:
            return d.dot(X.p) + shape.radius;
        case ShapeType::kBox: {
            Real sum = d.dot(X.p);
            for (int k = 0; k < 3; ++k) sum += std::abs(d.dot(X.R.col(k))) * shape.half_extents[k];
            return sum;
        }
        case ShapeType::kCapsule:
            return d.dot(X.p) + std::abs(d.dot(X.R.col(2))) * shape.half_height + shape.radius;
        case ShapeType::kCylinder: {
            const Lean lean = lean_of(s, d);
            return d.dot(X.p) + std::abs(lean.cos) * shape.half_height + lean.sin * shape.radius;
        }
        case ShapeType::kHull:
            return d.dot(X.p) + shape.hull->extent(X.R.transpose() * d);
        default:
            return d.dot(X.p);
    }
}

AxisSegment axis_segment(const PlacedShape& s, const Vec3& n) {
    const Vec3 z = s.X_WS.R.col(2);
    AxisSegment out;
    out.radius = s.shape->radius;
    Vec3 middle = s.X_WS.p;
    if (s.shape->type == ShapeType::kCylinder) {
        // The line along −n through a rim point meets the axis at radius / sin, shifted along it by radius cos / sin.
        const Lean lean = lean_of(s, n);
        const Real sine = std::max(lean.sin, 1e-6);
        out.radius /= sine;
        middle += (out.radius * lean.cos) * z;
    }
    out.end[0] = middle - s.shape->half_height * z;
    out.end[1] = middle + s.shape->half_height * z;
    return out;
}

bool face_normal_towards(const PlacedShape& s, const Vec3& d, Vec3& normal) {
    switch (s.shape->type) {
        case ShapeType::kBox: {
            bool positive = true;
            const int k = box_axis(s, d, positive);
            normal = positive ? Vec3(s.X_WS.R.col(k)) : Vec3(-s.X_WS.R.col(k));
            return true;
        }
        case ShapeType::kHull: {
            const ConvexHull& hull = *s.shape->hull;
            normal = s.X_WS.R * hull.faces()[hull.face_along(s.X_WS.R.transpose() * d)].normal;
            return true;
        }
        case ShapeType::kCylinder: {
            const Lean lean = lean_of(s, d);
            if (std::abs(lean.cos) < 0.5) return false;
            normal = lean.cos > 0 ? Vec3(s.X_WS.R.col(2)) : Vec3(-s.X_WS.R.col(2));
            return true;
        }
        default:
            return false;
    }
}

bool face_towards(const PlacedShape& s, const Vec3& d, Face& face) {
    switch (s.shape->type) {
        case ShapeType::kBox:
            box_face(s, d, face);
            return true;
        case ShapeType::kHull:
            hull_face(s, s.shape->hull->face_along(s.X_WS.R.transpose() * d), face);
            return true;
        case ShapeType::kCylinder: {
            const Lean lean = lean_of(s, d);
            if (std::abs(lean.cos) < 0.5) return false;
            cylinder_cap(s, d, lean, face);
            return true;
        }
        default:
            return false;
    }
}

bool lowest_face(const PlacedShape& s, const Vec3& d, Face& face) {
    if (s.shape->type != ShapeType::kHull) return face_towards(s, d, face);
    hull_face(s, hull_lowest_face_index(*s.shape->hull, s.X_WS.R.transpose() * d), face);
    return true;
}

int lowest_face_index(const PlacedShape& s, const Vec3& d) {
    if (s.shape->type == ShapeType::kHull) return hull_lowest_face_index(*s.shape->hull, s.X_WS.R.transpose() * d);
    if (s.shape->type != ShapeType::kBox) return -1;
    bool positive = true;
    const int k = box_axis(s, d, positive);
    return 2 * k + (positive ? 0 : 1);
}

AxisSegment box_edge_against(const Transform& X, const Vec3& half_extents, const Vec3& n) {
    // The corner farthest along −n, and the edge there that is most level.
    const Vec3& h = half_extents;
    const Vec3 local = X.R.transpose() * n;
    Vec3 corner;
    int level = 0;
    for (int k = 0; k < 3; ++k) {
        corner[k] = local[k] > 0 ? -h[k] : h[k];
        if (std::abs(local[k]) * h[k] < std::abs(local[level]) * h[level]) level = k;
    }
    Vec3 other = corner;
    corner[level] = -h[level];
    other[level] = h[level];
    return {{X * corner, X * other}, 0};
}

AxisSegment edge_against(const PlacedShape& s, const Vec3& n) {
    switch (s.shape->type) {
        case ShapeType::kBox:
            return box_edge_against(s.X_WS, s.shape->half_extents, n);
        case ShapeType::kHull:
            return hull_edge(s, n);
        case ShapeType::kSphere:
            return {{s.X_WS.p, s.X_WS.p}, s.shape->radius};
        default: {
            AxisSegment axis = axis_segment(s, n);
            // A tilted cylinder touches with one rim only, and so does a standing one as far as edges go.
            const Real along = n.dot(s.X_WS.R.col(2));
            constexpr Real kTilted = 1e-3;
            if (s.shape->type == ShapeType::kCylinder && std::abs(along) > kTilted) {
                if (lean_of(s, n).sin < kStanding) {
                    const Vec3 p = support_point(s, -n);
                    return {{p, p}, 0};
                }
                axis.end[along > 0 ? 1 : 0] = axis.end[along > 0 ? 0 : 1];
            }
            return axis;
        }
    }
}

Real make_core(const PlacedShape& s, Real shrink, fcl_query::Core& core) {
    using Kind = fcl_query::Core::Kind;
    const Shape& shape = *s.shape;
    core.R = s.X_WS.R;
    core.p = s.X_WS.p;
    core.centre.setZero();
    const Real drawn_in = shrink * inner_radius(shape);
    switch (shape.type) {
        case ShapeType::kBox:
            core.kind = Kind::kBox;
            core.half = shape.half_extents - Vec3::Constant(drawn_in);
            return drawn_in;
        case ShapeType::kCylinder:
            core.kind = Kind::kCylinder;
            core.half = Vec3(shape.radius - drawn_in, shape.radius - drawn_in, shape.half_height - drawn_in);
            return drawn_in;
        case ShapeType::kCapsule:
            core.kind = Kind::kSegment;
            core.half = Vec3(0, 0, shape.half_height);
            return shape.radius;
        case ShapeType::kHull:
            core.kind = Kind::kPoints;
            core.hull = shape.hull.get();
            core.points = shape.hull->vertices().data();
            core.count = static_cast<int>(shape.hull->vertices().size());
            core.centre = shape.hull->centroid();
            core.scale = 1 - shrink;
            return drawn_in;
        default:
            core.kind = Kind::kPoint;
            return shape.radius;
    }
}

}  // namespace cairn
