// From a contact direction to a manifold: the choice between faces and edges.
#include "collision/narrow_pair.hpp"

#include <algorithm>

namespace cairn::narrow {
namespace {

constexpr Real kSlack = 1e-5;       // of the size: matching faces are not cut by noise
constexpr Real kEqualDepth = 1e-4;  // of the size: so much differ equally deep points
constexpr Real kSteep = 0.01;       // [rad] between FCL's direction and a face normal that is taken in its stead without further proof

std::uint32_t feature_of(int incident_face, int face, std::uint8_t in, std::uint8_t out) {
    return (static_cast<std::uint32_t>(incident_face) & 0xffu) << 24 | (static_cast<std::uint32_t>(face) & 0xffu) << 16 |
           static_cast<std::uint32_t>(in) << 8 | out;
}

void push(Candidate* out, int& count, const Face& face, const Vec3& core, Real radius, Real margin, std::uint32_t feature) {
    const Real height = face.normal.dot(core) - face.offset;
    if (height - radius >= margin || count == kMaxCandidates) return;
    Candidate& c = out[count++];
    c.core = core;
    c.foot = core - height * face.normal;
    c.radius = radius;
    c.separation = height - radius;
    c.feature = feature;
}

int polygon_candidates(const Polygon& polygon, int index, const Face& face, Real margin, Real size, Candidate* out) {
    Polygon clipped;
    clip(polygon, face, kSlack * size, clipped);
    int count = 0;
    for (int i = 0; i < clipped.count; ++i) {
        const std::uint8_t in = clipped.edge[i == 0 ? clipped.count - 1 : i - 1];
        push(out, count, face, clipped.corner[i], 0, margin, feature_of(index, face.index, in, clipped.edge[i]));
    }
    return count;
}

int axis_candidates(const PlacedShape& s, const Face& face, Real margin, Real size, Candidate* out) {
    AxisSegment axis = axis_segment(s, face.normal);
    std::uint8_t name[2] = {0, 1};
    int count = 0;
    // Names for the ends: 1 and 2, or the side that cut them off.
    if (clip_segment(axis.end, name, face, kSlack * size))
        for (int i = 0; i < 2; ++i)
            push(out, count, face, axis.end[i], axis.radius, margin, feature_of(i + 1, face.index, name[i], static_cast<std::uint8_t>(i)));
    if (s.shape->type != ShapeType::kCylinder) return count;

    // A tilted cylinder may come down on its cap within the margin: two more points of the lower rim.
    const Lean lean = lean_of(s, face.normal);
    if (lean.sin > 0.5) return count;
    const Vec3 z = s.X_WS.R.col(2);
    const Vec3 cap = s.X_WS.p + (lean.cos > 0 ? -s.shape->half_height : s.shape->half_height) * z;
    const Vec3 u = (lean.cos * z - face.normal) / lean.sin;
    const Vec3 v = z.cross(u);
    for (int i = 0; i < 2; ++i) {
        const Vec3 p = cap + s.shape->radius * (-0.5 * u + (i == 0 ? 1 : -1) * std::sqrt(0.75) * v);
        if (is_over(p, face, kSlack * size)) push(out, count, face, p, 0, margin, feature_of(i + 3, face.index, 0, 0));
    }
    return count;
}

// Where two discs overlap: the two points of the lens where the circles cross, and its two tips; or four points of a disc held by the
// other.
int lens_candidates(const Face& disc, const Face& face, Real margin, Candidate* out) {
    const Vec3 between = face.disc_centre - disc.disc_centre;
    const Vec3 aside = between - face.normal.dot(between) * face.normal;
    const Real d = aside.norm(), r = disc.disc_radius, R = face.disc_radius;
    if (d >= r + R) return 0;
    // On the plane of the incident disc, whose tilt against the face is small.
    const auto on_disc = [&](const Vec3& p) {
        return Vec3(p - disc.normal.dot(p - disc.disc_centre) / disc.normal.dot(face.normal) * face.normal);
    };
    int count = 0;
    const auto add = [&](const Vec3& p, int name) {
        push(out, count, face, on_disc(p), 0, margin, feature_of(disc.index, face.index, 1, static_cast<std::uint8_t>(name)));
    };
    if (d <= r - R) {
        for (int k = 0; k < 4; ++k) add(face.outline.corner[k * (kMaxOutline / 4)], 4 + k);
        return count;
    }
    const Vec3 e = aside / d, f = face.normal.cross(e);
    const Vec3& c = disc.disc_centre;
    const Real x = std::clamp((d * d + r * r - R * R) / (2 * d), -r, r);
    const Real y = std::sqrt(r * r - x * x);
    add(c + std::min(r, d + R) * e, 0);
    add(c + x * e + y * f, 1);
    add(c + std::max(d - R, -r) * e, 2);
    add(c + x * e - y * f, 3);
    return count;
}

// A standing cylinder: wholly over the face four rim points, which stay the same while it turns.
int cap_candidates(const Face& cap, const Face& face, Real margin, Real size, Candidate* out) {
    constexpr int kStep = kMaxOutline / 4;
    const Real slack = face.disc_radius > 0 ? 1e-3 * size : kSlack * size;
    bool all_over = true;
    for (int k = 0; k < 4; ++k) all_over = all_over && is_over(cap.outline.corner[k * kStep], face, slack);
    if (!all_over && face.disc_radius > 0) return lens_candidates(cap, face, margin, out);
    if (!all_over) return polygon_candidates(cap.outline, cap.index, face, margin, size, out);
    int count = 0;
    for (int k = 0; k < 4; ++k)
        push(out, count, face, cap.outline.corner[k * kStep], 0, margin,
             feature_of(cap.index, face.index, 0, static_cast<std::uint8_t>(k)));
    return count;
}

struct FaceChoice {
    Vec3 normal = Vec3::Zero();  // outward
    Real separation = 0;         // of the shapes along it
    Real angle = 0;              // sine of the angle to FCL's direction, >= 1 if it is wide
    bool exists = false;
};

FaceChoice judge_face(const PlacedShape& owner, const PlacedShape& other, const Vec3& d) {
    FaceChoice f;
    f.exists = face_normal_towards(owner, d, f.normal);
    if (!f.exists) return f;
    f.separation = -support(other, -f.normal) - support(owner, f.normal);
    f.angle = f.normal.dot(d) > 0.5 ? f.normal.cross(d).norm() : 1;
    return f;
}

// Tries a face contact; false if the face is not what the shapes touch with.
bool try_face(Query& q, const FaceChoice& f, bool face_is_b, Real along_n) {
    const PlacedShape& owner = face_is_b ? q.b : q.a;
    const PlacedShape& other = face_is_b ? q.a : q.b;
    const bool near_n = f.angle < kSteep;
    // Away from FCL's direction the face must be the better separating direction itself.
    if (!near_n && f.separation < along_n - (0.01 * std::abs(along_n) + 1e-6 * q.size)) return false;
    Face face;
    if (!face_towards(owner, f.normal, face)) return false;
    Candidate candidates[kMaxCandidates];
    const int count = face_candidates(other, face, q.margin, q.size, candidates);
    if (count == 0) return false;
    Real deepest = candidates[0].separation;
    for (int i = 1; i < count; ++i) deepest = std::min(deepest, candidates[i].separation);
    // The points must tell the depth that FCL found, or what touches is an edge outside the face.
    const Real doubt =
        near_n ? 0.05 * std::abs(along_n) + (std::min(2 * f.angle, 2e-4) + 1e-5) * q.size : 0.02 * std::abs(along_n) + 1e-5 * q.size;
    if (std::abs(deepest - along_n) > doubt) return false;
    add_face_manifold(q, f.normal, face_is_b, candidates, count);
    return true;
}

// The manifold along n, given the shapes' separation along it and the faces on either side.
bool try_features(Query& q, const Vec3& n, Real along_n, const FaceChoice& a, const FaceChoice& b, NarrowResult& result) {
    // The face along which the shapes are farther apart; of nearly equal ones A's, or the one that had the last contact.
    bool b_first = !a.exists;
    if (a.exists && b.exists) {
        // The cached normal was a face's if it has not moved against it.
        constexpr Real kRounding2 = 1e-28;
        // The first time a cap yields to a polygon: its rim points move with it, those of the clip would not.
        const bool last_was_b = !q.was_touching ? q.a.shape->type == ShapeType::kCylinder && q.b.shape->type != ShapeType::kCylinder
                                                : (q.axis_in_b ? (q.axis - b.normal).squaredNorm() < kRounding2
                                                               : (q.axis + a.normal).squaredNorm() > kRounding2);
        const Real sticky = (q.was_touching ? 1e-4 : 1e-6) * q.size + 0.01 * std::abs(along_n);
        b_first = b.separation > a.separation + (last_was_b ? -sticky : sticky);
    }
    for (const bool use_b : {b_first, !b_first}) {
        const FaceChoice& f = use_b ? b : a;
        if (!f.exists || !try_face(q, f, use_b, along_n)) continue;
        result = NarrowResult::kTouching;
        return true;
    }
    return try_segments(q, n, edge_against(q.a, n), edge_against(q.b, -n), result);
}

}  // namespace

bool comes_down_flat(const PlacedShape& incident, const Vec3& normal, Face& lowest) {
    const ShapeType type = incident.shape->type;
    if (type == ShapeType::kCylinder && lean_of(incident, normal).sin > kStanding) return false;
    return lowest_face(incident, -normal, lowest);
}

int flat_candidates(const Face& lowest, const Face& face, Real margin, Real size, Candidate out[kMaxCandidates]) {
    if (lowest.disc_radius > 0) return cap_candidates(lowest, face, margin, size, out);
    return polygon_candidates(lowest.outline, lowest.index, face, margin, size, out);
}

int face_candidates(const PlacedShape& incident, const Face& face, Real margin, Real size, Candidate out[kMaxCandidates]) {
    if (incident.shape->type == ShapeType::kSphere) {
        int count = 0;
        if (is_over(incident.X_WS.p, face, kSlack * size)) push(out, count, face, incident.X_WS.p, incident.shape->radius, margin, 0);
        return count;
    }
    Face lowest;
    if (comes_down_flat(incident, face.normal, lowest)) return flat_candidates(lowest, face, margin, size, out);
    return axis_candidates(incident, face, margin, size, out);
}

void add_face_manifold(Query& q, const Vec3& face_normal, bool face_is_b, Candidate* candidates, int count) {
    count = reduce(candidates, count, face_normal, kEqualDepth * q.size);
    Manifold& m = q.out.emplace_back();
    m.n = face_is_b ? face_normal : Vec3(-face_normal);
    m.owner = face_is_b ? NormalOwner::kB : NormalOwner::kA;
    m.count = count;
    for (int i = 0; i < count; ++i) {
        const Candidate& c = candidates[i];
        ManifoldPoint& p = m.points[i];
        p.core_a = face_is_b ? c.core : c.foot;
        p.core_b = face_is_b ? c.foot : c.core;
        p.radius_a = face_is_b ? c.radius : 0;
        p.radius_b = face_is_b ? 0 : c.radius;
        p.separation = c.separation;
        p.feature = c.feature ^ (face_is_b ? 0u : 0x8000u);
    }
    q.axis = m.n;
}

NarrowResult add_point(Query& q, const Vec3& n, NormalOwner owner, const Vec3& core_a, Real radius_a, const Vec3& core_b, Real radius_b,
                       std::uint32_t feature) {
    const Real separation = n.dot(core_a - core_b) - radius_a - radius_b;
    q.axis = n;
    if (separation >= q.margin) return NarrowResult::kSeparated;
    Manifold& m = q.out.emplace_back();
    m.n = n;
    m.owner = owner;
    m.count = 1;
    m.points[0] = {core_a, core_b, radius_a, radius_b, separation, feature};
    return NarrowResult::kTouching;
}

bool try_manifold(Query& q, const Vec3& n, NarrowResult& result) {
    const Real along_n = separation_along(q, n);
    if (along_n >= q.margin) {
        result = separated(q, n);
        return true;
    }
    return try_features(q, n, along_n, judge_face(q.a, q.b, -n), judge_face(q.b, q.a, n), result);
}

bool try_last_contact(Query& q, NarrowResult& result) {
    constexpr Real kShallow = 0.005;  // of the size: overlaps that are not asked whether there is a shorter way out elsewhere
    constexpr Real kTurned = 0.2;     // [rad] within which the nearest face is taken for the one of the last contact
    if (!q.was_touching) return false;
    const Vec3 last = q.axis;
    const FaceChoice faces[2] = {judge_face(q.a, q.b, -last), judge_face(q.b, q.a, last)};
    Real best = separation_along(q, last);  // no direction along which they are nearer is the one
    for (const FaceChoice& f : faces)
        if (f.exists) best = std::max(best, f.separation);
    if (best < -kShallow * q.size) return false;
    const Real tie = 1e-4 * q.size + 0.01 * std::abs(best);
    for (int k = 0; k < 2; ++k) {
        const FaceChoice& f = faces[k];
        if (!f.exists || f.angle > kTurned || f.separation < best - tie) continue;
        const Vec3 n = k == 1 ? f.normal : Vec3(-f.normal);
        if (f.separation >= q.margin) {
            result = separated(q, n);
            return true;
        }
        Face face;
        const PlacedShape &owner = k == 1 ? q.b : q.a, &other = k == 1 ? q.a : q.b;
        if (!face_towards(owner, f.normal, face)) continue;
        if (!is_over(support_point(other, -f.normal), face, 0)) continue;
        const FaceChoice own = {f.normal, f.separation, 0, true};
        return k == 1 ? try_features(q, n, f.separation, judge_face(q.a, q.b, -n), own, result)
                      : try_features(q, n, f.separation, own, judge_face(q.b, q.a, n), result);
    }
    return false;
}

}  // namespace cairn::narrow
