#include "tests/support/allocation_count.hpp"

#include "tests/support/catch.hpp"
#include "tests/unit/narrow/narrow_support.hpp"

using namespace narrow_test;

TEST_CASE("a warmed query allocates nothing, touching, near, deep or apart") {
    Random r(2);
    const Shape shapes[] = {Shape::sphere(0.5),
                            Shape::box(Vec3(0.5, 0.4, 0.3)),
                            Shape::capsule(0.3, 0.5),
                            Shape::cylinder(0.5, 0.4),
                            hull_of(r, 32, 0.6),
                            Shape::plane(Vec3::UnitZ(), 0),
                            grid_mesh(16, 0.25, [](Real x, Real y) { return 0.05 * std::sin(x) * std::cos(0.7 * y); })};
    for (const Shape& a : shapes) {
        for (const Shape& b : shapes) {
            if (a.is_static_only()) continue;
            CAPTURE(static_cast<int>(a.type), static_cast<int>(b.type));
            std::vector<Transform> poses;
            for (int i = 0; i < 200; ++i)
                poses.push_back(at(uniform(r, -0.5, 0.5), uniform(r, -0.5, 0.5), uniform(r, -0.5, 1.5), random_rotation(r)));
            std::vector<Manifold> out;
            out.reserve(64);
            NarrowStats stats;
            const auto run = [&] {
                PairCache cache;
                for (const Transform& X : poses) {
                    out.clear();
                    collide_shapes({&a, X}, {&b, at(0, 0, 0)}, 0.05, cache, out, stats);
                }
            };
            run();
            const std::uint64_t before = allocation_count::count();
            run();
            CHECK(allocation_count::count() == before);
            CHECK(stats.failures == 0);
        }
    }
}
