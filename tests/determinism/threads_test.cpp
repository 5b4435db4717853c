// The bits of a run do not depend on who runs its tasks, in which order and on how many threads.
#include "engine/tasks.hpp"
#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <atomic>
#include <thread>

using namespace cairn;
using namespace world_building;

namespace {

// Threads of the standard library, which the thread sanitizer can follow; and what a game's own task system looks like.
class StandardThreads : public TaskSystem {
public:
    explicit StandardThreads(int workers) : workers_(workers) {}
    int workers() const override { return workers_; }
    void run(int count, Task task, void* context) override {
        std::atomic<int> next = 0;
        const auto work = [&](int worker) {
            for (int i = next++; i < count; i = next++) task(context, i, worker);
        };
        std::vector<std::thread> threads;
        for (int k = 1; k < workers_; ++k) threads.emplace_back(work, k);
        work(0);
        for (std::thread& t : threads) t.join();
        ++runs;
    }
    double start_time() const override { return 0; }  // so that each step asks for it
    int runs = 0;

private:
    int workers_;
};

// One thread that runs the last task first, as another worker each time.
class Backwards : public TaskSystem {
public:
    int workers() const override { return 3; }
    void run(int count, Task task, void* context) override {
        for (int i = count; i-- > 0;) task(context, i, i % 3);
    }
    double start_time() const override { return 0; }
};

// Stacks that rest, tumble and get hit, chains, a board that rocks under boxes, and a swarm that flies alone: islands of every solver.
void build_everything(World& world) {
    Random r(7);
    world.add_body(ground());
    for (int k = 0; k < 12; ++k)
        for (int j = 0; j < 3; ++j) world.add_body(cube(0.5, {3.0 * k, 0.03 * j, 0.25 + 0.5 * j}));
    for (int k = 0; k < 4; ++k) {
        BodyDef hit = ball(0.3, {3.0 * k, -3, 0.8}, 3);
        hit.linear_velocity = {0, 8, 1};
        world.add_body(hit);
    }
    for (int k = 0; k < 40; ++k) {
        BodyDef b = body(random_shape(r), {-4 + r.uniform(-0.8, 0.8), r.uniform(-0.8, 0.8), 0.5 + 0.2 * k});
        b.rotation = r.rotation();
        world.add_body(b);
    }
    for (int c = 0; c < 4; ++c) {
        BodyId previous;
        for (int k = 0; k < 4; ++k) {
            const BodyId id = world.add_body(body(Shape::box({0.2, 0.1, 0.1}), {0.5 * k, 10.0 + c, 3}));
            world.add_joint({JointType::kBall, id, previous, {0.5 * k - 0.25, 10.0 + c, 3}});
            previous = id;
        }
    }
    BodyDef board;
    board.type = BodyType::kKinematic;
    board.position = {0, -10, 1};
    board.shapes = {Shape::box({8, 1, 0.1})};
    board.motion = RotateSine{Vec3::UnitX(), 0.2, 1, 0};
    world.add_body(board);
    for (int k = 0; k < 6; ++k) world.add_body(cube(0.4, {2.0 * k - 5, -10, 1.3}));
    for (int k = 0; k < 700; ++k) {
        BodyDef b = k % 2 ? ball(0.2, {0, 0, 0}) : body(Shape::box({0.2, 0.15, 0.1}), {0, 0, 0});
        b.position = {3.0 * (k % 20), 40 + 3.0 * (k / 20 % 20), 60 + 3.0 * (k / 400)};
        b.linear_velocity = r.vector(1);
        b.angular_velocity = r.vector(4);
        if (k % 50 == 0) b.torque = {0.01, 0, 0};
        world.add_body(b);
    }
}

struct Step {
    std::uint64_t hash;
    std::uint32_t islands, normal_rows, free_bodies, sleeping;
    std::uint64_t contact_sweeps, joint_sweeps, rotor_calls;
    Real residual;
    bool operator==(const Step&) const = default;
};

std::vector<Step> steps_of(const WorldSettings& settings, int count) {
    World world(settings);
    build_everything(world);
    std::vector<Step> out;
    for (int k = 0; k < count; ++k) {
        const StepReport r = world.step(kStep);
        out.push_back({world.hash(), r.islands, r.normal_rows, r.free_bodies, r.sleeping_bodies, r.contact_sweeps, r.joint_sweeps,
                       r.rotor_calls, r.residual});
    }
    return out;
}

}  // namespace

TEST_CASE("a run has the same bits on one thread and on several") {
    WorldSettings settings;
    settings.sleep = true;
    constexpr int kCount = 30;
    const std::vector<Step> alone = steps_of(settings, kCount);
    CHECK(alone.back().islands + alone.back().sleeping > 10);
    CHECK(alone.back().free_bodies >= 700);
    SECTION("threads of the library") {
        for (const int threads : {2, 4}) {
            settings.threads = threads;
            CHECK(steps_of(settings, kCount) == alone);
        }
    }
    SECTION("a task system of the caller's") {
        const auto tasks = std::make_shared<StandardThreads>(3);
        settings.tasks = tasks;
        CHECK(steps_of(settings, kCount) == alone);
        CHECK(tasks->runs == kCount);  // it was asked, once a step
    }
    SECTION("in another order") {
        settings.tasks = std::make_shared<Backwards>();
        CHECK(steps_of(settings, kCount) == alone);
    }
}

TEST_CASE("a pile has the same bits on any number of threads") {
    const auto run_pile = [](std::shared_ptr<TaskSystem> tasks) {
        WorldSettings settings;
        settings.tasks = std::move(tasks);
        World world(settings);
        world.add_body(ground());
        Random r(3);
        for (int k = 0; k < 250; ++k) {
            BodyDef b = body(k % 3 ? Shape::box({0.3, 0.25, 0.2}) : Shape::sphere(0.25), Vec3::Zero());
            b.position = {0.5 * (k % 6) + r.uniform(0, 0.05), 0.5 * (k / 6 % 6), 0.25 + 0.45 * (k / 36)};
            if (k % 2) b.rotation = r.rotation();
            world.add_body(b);
        }
        std::vector<std::uint64_t> hashes;
        std::uint32_t most_contacts = 0;
        for (int k = 0; k < 10; ++k) {
            most_contacts = std::max(most_contacts, world.step(kStep).contacts);
            hashes.push_back(world.hash());
        }
        CHECK(most_contacts > 500);  // enough of them to be shared out
        return hashes;
    };
    const std::vector<std::uint64_t> alone = run_pile(nullptr);
    for (const int threads : {1, 2, 3, 8}) CHECK(run_pile(std::make_shared<StandardThreads>(threads)) == alone);
    CHECK(run_pile(std::make_shared<Backwards>()) == alone);
    CHECK(run_pile(make_task_system(2)) == alone);
}

// One large island that is solved directly: columns of its factor, and solves for rows that change, are shared out.
TEST_CASE("a pyramid that is solved directly has the same bits on any number of threads") {
    const auto run_pyramid = [](std::shared_ptr<TaskSystem> tasks) {
        WorldSettings settings;
        settings.tasks = std::move(tasks);
        World world(settings);
        world.add_body(ground(0.6));
        const int rows = 30;
        for (int row = 0; row < rows; ++row)
            for (int k = 0; k < rows - row; ++k) world.add_body(cube(1, {1.04 * (k + 0.5 * row), 0, 0.5 + row}, 1, 0.6));
        const StepReport first = world.step(kStep);
        CHECK(first.islands_of[static_cast<int>(SolverChoice::kDirect)] == 1);
        CHECK(first.factorisations > 0);
        std::vector<std::uint64_t> hashes{world.hash()};
        world.step(kStep);
        hashes.push_back(world.hash());
        return hashes;
    };
    const std::vector<std::uint64_t> alone = run_pyramid(nullptr);
    for (const int threads : {1, 2, 3, 8}) CHECK(run_pyramid(std::make_shared<StandardThreads>(threads)) == alone);
    CHECK(run_pyramid(std::make_shared<Backwards>()) == alone);
}

TEST_CASE("what goes non-finite on several threads is taken out as on one") {
    const auto out = [](std::shared_ptr<TaskSystem> tasks) {
        WorldSettings settings;
        settings.tasks = std::move(tasks);
        World world(settings);
        world.add_body(ground());
        for (int k = 0; k < 600; ++k) {
            BodyDef b = ball(0.2, {1.0 * (k % 30), 1.0 * (k / 30), 50});
            if (k % 100 == 7) b.linear_velocity = {1.7e308, 0, 0};
            if (k % 100 == 7) b.force = {1e308, 0, 0};
            world.add_body(b);
        }
        std::uint32_t disabled = 0;
        for (int k = 0; k < 5; ++k) disabled += world.step(1.0).bodies_disabled;
        return std::pair(disabled, world.hash());
    };
    const auto alone = out(nullptr);
    CHECK(alone.first == 6);
    CHECK(out(std::make_shared<StandardThreads>(3)) == alone);
    CHECK(out(std::make_shared<Backwards>()) == alone);
}
