// No allocation in a warmed-up step.
#include "tests/support/allocation_count.hpp"

#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

using namespace cairn;
using namespace world_building;

namespace {

void allocates_nothing(World& world, Real warm_up, Real duration) {
    run(world, warm_up);
    const std::uint64_t before = allocation_count::count();
    run(world, duration);
    CHECK(allocation_count::count() - before == 0);
}

}  // namespace

TEST_CASE("a step of a settled stack allocates nothing") {
    World world;
    world.add_body(ground());
    for (int k = 0; k < 10; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}));
    allocates_nothing(world, 1, 1);
}

TEST_CASE("a step of a rolling ball allocates nothing") {
    World world;
    world.add_body(ground());
    BodyDef b = ball(0.5, {0, 0, 0.5});
    b.linear_velocity = {3, 0, 0};
    b.angular_velocity = {0, 6, 0};
    world.add_body(b);
    allocates_nothing(world, 0.5, 2);
}

TEST_CASE("a step of a swinging chain allocates nothing") {
    const JointType type = GENERATE(JointType::kBall, JointType::kHinge, JointType::kFixed);
    World world;
    BodyId previous;
    for (int k = 0; k < 10; ++k) {  // hangs, and swings too little for links to meet that have not met before
        BodyDef link = body(Shape::capsule(0.05, 0.15), {0, 0, -0.5 * k - 0.25});
        link.linear_velocity = {0.02 * k, 0, 0};
        const BodyId next = world.add_body(link);
        world.add_joint({type, next, previous, {0, 0, -0.5 * k}, Vec3::Zero(), Vec3::UnitY()});
        previous = next;
    }
    allocates_nothing(world, 0.5, 1);
}

TEST_CASE("a step of a chain that slides over the ground allocates nothing") {
    World world;
    world.add_body(ground(0.1));
    BodyId previous;
    for (int k = 0; k < 6; ++k) {
        BodyDef link = body(Shape::box({0.2, 0.1, 0.1}), {0.5 * k, 0, 0.1});
        link.linear_velocity = {3, 0, 0};
        const BodyId next = world.add_body(link);
        if (k > 0) world.add_joint({JointType::kBall, previous, next, {0.5 * k - 0.25, 0, 0.1}});
        previous = next;
    }
    allocates_nothing(world, 0.5, 1);
}

TEST_CASE("a step of bodies that slide over each other and over a mesh allocates nothing") {
    std::vector<Vec3> vertices;
    std::vector<std::array<int, 3>> triangles;
    for (int x = 0; x <= 10; ++x)
        for (int y = 0; y <= 10; ++y) vertices.emplace_back(x - 5, y - 5, 0);
    for (int x = 0; x < 10; ++x)
        for (int y = 0; y < 10; ++y) {
            const int i = 11 * x + y;
            triangles.push_back({i, i + 11, i + 12});
            triangles.push_back({i, i + 12, i + 1});
        }
    World world;
    world.add_body(fixed(Shape::triangle_mesh(vertices, triangles), Vec3::Zero(), 0.1));
    for (int k = 0; k < 3; ++k) {
        BodyDef b = cube(1, {-3.0, -2.0 + 2 * k, 0.5}, 1, 0.1);
        b.linear_velocity = {3, 0, 0};
        b.rotation = turn({0, 0, 1}, 0.3 * k);
        world.add_body(b);
    }
    allocates_nothing(world, 1, 0.5);
}

TEST_CASE("a step of a sleeping world allocates nothing") {
    WorldSettings settings;
    settings.sleep = true;
    World world(settings);
    world.add_body(ground());
    for (int k = 0; k < 5; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}));
    allocates_nothing(world, 3, 1);
}

TEST_CASE("a step of a settled wall, swept four contacts at a time, allocates nothing") {
    WorldSettings settings;
    settings.solver = SolverChoice::kSi;
    World world(settings);
    world.add_body(ground());
    for (int row = 0; row < 4; ++row)
        for (int k = 0; k < 12 - row % 2; ++k) world.add_body(cube(1, {k + 0.5 * (row % 2), 0, 0.5 + row}));
    allocates_nothing(world, 0.5, 0.5);
}

TEST_CASE("a step of a pile that workers share allocates nothing") {
    // Its workers come one after the other on the calling thread, so that each run of this test is the same.
    class OnTheCaller : public TaskSystem {
    public:
        int workers() const override { return 2; }
        void run(int count, Task task, void* context) override {
            for (int i = 0; i < count; ++i) task(context, i, i);
        }
        double start_time() const override { return 0; }
    };
    WorldSettings settings;
    settings.tasks = std::make_shared<OnTheCaller>();
    settings.solver = SolverChoice::kSi;
    World world(settings);
    world.add_body(ground());
    for (int k = 0; k < 200; ++k)  // layers, each on the joints of the one below; they have settled after 2.5 s
        world.add_body(cube(0.5, {0.52 * (k % 10) + 0.26 * (k / 50 % 2), 0.52 * (k / 10 % 5), 0.25 + 0.5 * (k / 50)}));
    allocates_nothing(world, 3, 0.5);
}
