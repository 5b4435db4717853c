#include "collision/shape.hpp"

#include "engine/base/error.hpp"
#include "engine/scene/detail/parts.hpp"
#include "engine/scene/detail/reader.hpp"

#include <array>
#include <cstdint>

namespace cairn::scene_detail {

namespace {

std::vector<Vec3> read_points(ObjectReader& reader, std::string_view key, std::size_t least, Mistakes& mistakes) {
    std::vector<Vec3> points;
    const Json* list = reader.list(key, Need::kRequired, "points [x, y, z]");
    if (list == nullptr) return points;
    Mistakes::Scope in(mistakes, key);
    points.resize(list->size(), Vec3::Zero());
    for (std::size_t i = 0; i < list->size(); ++i) {
        Mistakes::Scope at(mistakes, i);
        read_vec3((*list)[i], Range::kAny, mistakes, points[i]);
    }
    if (points.size() < least) mistakes.add(quoted(*list) + ", must be at least " + std::to_string(least) + " points");
    return points;
}

// Notes what is wrong with one triangle's vertex numbers; true if nothing is.
bool read_triangle(const Json& value, const std::vector<Vec3>& vertices, Mistakes& mistakes, std::array<int, 3>& out) {
    if (!value.is_array() || value.size() != 3) {
        mistakes.add(quoted(value) + ", must be a list of 3 vertex numbers");
        return false;
    }
    bool right = true;
    for (std::size_t k = 0; k < 3; ++k) {
        const Json& index = value[k];
        const bool in_range = index.is_number_unsigned() && index.get<std::uint64_t>() < vertices.size();
        if (in_range) {
            out[k] = static_cast<int>(index.get<std::uint64_t>());
        } else {
            Mistakes::Scope at(mistakes, k);
            mistakes.add(quoted(index) + ", must be a whole number from 0 to " +
                         std::to_string(static_cast<std::int64_t>(vertices.size()) - 1));
            right = false;
        }
    }
    if (!right) return false;
    const Vec3 ab = vertices[out[1]] - vertices[out[0]];
    const Vec3 ac = vertices[out[2]] - vertices[out[0]];
    // Below this share of its sides the area of a triangle is rounding error of its corners.
    constexpr Real kThinnest = 1e-12;
    if (!(ab.cross(ac).norm() > kThinnest * (ab.squaredNorm() + ac.squaredNorm()))) {
        mistakes.add(quoted(value) + ", must be a triangle with an area");
        return false;
    }
    return true;
}

Shape read_mesh(ObjectReader& reader, const Pose& X_BS, Mistakes& mistakes) {
    const std::size_t before = mistakes.count();
    std::vector<Vec3> vertices = read_points(reader, "vertices", 3, mistakes);
    const Json* list = reader.list("triangles", Need::kRequired, "triangles [i, j, k]");
    // Numbers of vertices that could not be read would only repeat the mistake.
    if (list == nullptr || mistakes.count() != before) return {};
    std::vector<std::array<int, 3>> triangles(list->size());
    {
        Mistakes::Scope in(mistakes, std::string_view("triangles"));
        if (list->empty()) mistakes.add("a list of 0, must be at least 1 triangle");
        for (std::size_t i = 0; i < list->size(); ++i) {
            Mistakes::Scope at(mistakes, i);
            read_triangle((*list)[i], vertices, mistakes, triangles[i]);
        }
    }
    if (mistakes.count() != before) return {};
    return Shape::triangle_mesh(std::move(vertices), std::move(triangles), X_BS);
}

Shape read_convex(ObjectReader& reader, const Pose& X_BS, Mistakes& mistakes) {
    const std::size_t before = mistakes.count();
    const std::vector<Vec3> points = read_points(reader, "points", 4, mistakes);
    if (mistakes.count() != before) return {};
    Mistakes::Scope in(mistakes, std::string_view("points"));
    try {
        return Shape::convex(points, X_BS);
    } catch (const Error& error) {
        mistakes.add(std::string("must span a volume: ") + error.what());
        return {};
    }
}

Shape read_round(ShapeType type, ObjectReader& reader, const Pose& X_BS, Mistakes& mistakes) {
    const std::size_t before = mistakes.count();
    Real radius = 0, half_height = 0;
    reader.number("radius", radius, Range::kPositive, Need::kRequired);
    if (type != ShapeType::kSphere) reader.number("half_height", half_height, Range::kPositive, Need::kRequired);
    if (mistakes.count() != before) return {};
    if (type == ShapeType::kCapsule) return Shape::capsule(radius, half_height, X_BS);
    if (type == ShapeType::kCylinder) return Shape::cylinder(radius, half_height, X_BS);
    return Shape::sphere(radius, X_BS);
}

Shape read_box(ObjectReader& reader, const Pose& X_BS) {
    Vec3 half_extents;
    if (!reader.vec3("half_extents", half_extents, Need::kRequired, Range::kPositive)) return {};
    return Shape::box(half_extents, X_BS);
}

Shape read_plane(ObjectReader& reader) {
    Vec3 normal;
    Real offset = 0;
    const bool has_normal = reader.unit_vec3("normal", normal, Need::kRequired);
    const bool has_offset = reader.number("offset", offset, Range::kAny, Need::kRequired);
    return has_normal && has_offset ? Shape::plane(normal, offset) : Shape{};
}

Shape read_geometry(ShapeType type, ObjectReader& reader, const Pose& X_BS, Mistakes& mistakes) {
    switch (type) {
        case ShapeType::kBox:
            return read_box(reader, X_BS);
        case ShapeType::kHull:
            return read_convex(reader, X_BS, mistakes);
        case ShapeType::kPlane:
            return read_plane(reader);
        case ShapeType::kMesh:
            return read_mesh(reader, X_BS, mistakes);
        default:
            return read_round(type, reader, X_BS, mistakes);
    }
}

}  // namespace

std::optional<Shape> read_shape(const Json& value, Mistakes& mistakes) {
    static const std::vector<std::string_view> kNames = {"box", "sphere", "capsule", "cylinder", "convex", "plane", "mesh"};
    static const std::vector<ShapeType> kTypes = {ShapeType::kBox,  ShapeType::kSphere, ShapeType::kCapsule, ShapeType::kCylinder,
                                                  ShapeType::kHull, ShapeType::kPlane,  ShapeType::kMesh};
    const std::size_t before = mistakes.count();
    ObjectReader reader(value, mistakes);
    std::size_t type = 0;
    // Without the type nobody knows which keys belong here.
    if (!reader.word("type", kNames, type, Need::kRequired)) return {};
    Pose X_BS;
    reader.vec3("position", X_BS.p, Need::kOptional);
    reader.rotation("rotation", X_BS.q, Need::kOptional);
    Shape shape;
    try {
        shape = read_geometry(kTypes[type], reader, X_BS, mistakes);
    } catch (const Error& error) {
        mistakes.add(error.what());  // a rule of the shape's maker that is not one of the file format
    }
    reader.finish();
    if (mistakes.count() != before) return {};
    return shape;
}

}  // namespace cairn::scene_detail
