// What a step tells about itself: residuals, who solved what, and how far joints and contacts are off.
#include "tests/support/allocation_count.hpp"

#include "engine/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/world_building.hpp"

#include <functional>

using namespace cairn;
using namespace world_building;

namespace {

WorldSettings diagnosed(SolverChoice solver = SolverChoice::kAuto) {
    WorldSettings settings;
    settings.diagnostics = true;
    settings.solver = solver;
    return settings;
}

void build_stack(World& world, int count = 5, Real top_mass = 1) {
    world.add_body(ground());
    for (int k = 0; k < count; ++k) world.add_body(cube(1, {0, 0, 0.5 + k}, k == count - 1 ? top_mass : 1));
}

void build_wall(World& world) {
    world.add_body(ground());
    for (int row = 0; row < 4; ++row)
        for (int k = 0; k < 12 - row % 2; ++k) world.add_body(cube(1, {k + 0.5 * (row % 2), 0, 0.5 + row}));
}

// Hangs from the world, or (with a ground below) swings onto it.
void build_chain(World& world, bool touches) {
    if (touches) world.add_body(fixed(Shape::plane(Vec3::UnitZ(), -0.8)));
    BodyId previous;
    for (int k = 0; k < 5; ++k) {
        const BodyId next = world.add_body(body(Shape::capsule(0.05, 0.1), {0.4 * k + 0.2, 0, 0}));
        world.add_joint({JointType::kBall, next, previous, {0.4 * k, 0, 0}});
        previous = next;
    }
}

}  // namespace

TEST_CASE("a step that was not asked for diagnostics has none") {
    World world;
    build_stack(world);
    CHECK(world.step(kStep).diagnostics == nullptr);
}

TEST_CASE("a diagnosed world steps to the same bits") {
    const std::function<void(World&)> scenes[] = {[](World& w) { build_stack(w); }, build_wall, [](World& w) { build_chain(w, false); },
                                                  [](World& w) { build_chain(w, true); }};
    const int scene = GENERATE(range(0, 4));
    const bool textbook = GENERATE(false, true);
    const bool forced = scene < 2 && !textbook && GENERATE(false, true);
    CAPTURE(scene, textbook, forced);
    WorldSettings settings;
    if (textbook) settings.stabilisation = Stabilisation::kSoft;
    if (forced) settings.solver = SolverChoice::kSi;
    World plain(settings);
    settings.diagnostics = true;
    World measured(settings);
    scenes[scene](plain);
    scenes[scene](measured);
    run(plain, 0.5);
    run(measured, 0.5);
    CHECK(plain.hash() == measured.hash());
}

TEST_CASE("sweeps that go on leave less of the residual, and a direct solve next to nothing") {
    Real residual[3];
    for (int k = 0; k < 3; ++k) {
        WorldSettings settings = diagnosed(k < 2 ? SolverChoice::kSi : SolverChoice::kDirect);
        settings.iterations = k == 0 ? 1 : 10000;
        settings.residual_tolerance = 0;
        World world(settings);
        build_stack(world, 3, 5);
        const StepResidual r = world.step(kStep).diagnostics->residual;
        residual[k] = r.max;
        CHECK(r.rows == (k < 2 ? 4 : 1) * 36u);  // 3 manifolds of 4 points of 3 rows, in 4 substeps, or in one where all is quiet
        CHECK(r.rms <= r.max);
        CHECK(r.rms * std::sqrt(static_cast<Real>(r.rows)) >= r.max);
    }
    // One sweep passes on what one box weighs, and leaves the others' kick of g h / 2 = 0.02 m/s.
    CHECK(residual[0] > 1e-3);
    // Three boxes, the top one five times as heavy: sweeps contract by 0.3 % at least, 10000 of them by 1e-13.
    CHECK(residual[1] < 1e-9);
    CHECK(residual[2] < 1e-9);  // DirectSettings::tolerance is 1e-11, and rest_tolerance 1e-9
}

TEST_CASE("the worst row is told with its bodies and its kind") {
    WorldSettings settings = diagnosed(SolverChoice::kSi);
    settings.iterations = 1;
    World world(settings);
    world.add_body(ground());
    world.add_body(ball(0.5, {9, 0, 0.5}));  // rests, and is solved by one sweep
    const BodyId lower = world.add_body(cube(1, {0, 0, 0.5})), upper = world.add_body(cube(1, {0, 0, 1.5}, 1000));
    const StepResidual r = world.step(kStep).diagnostics->residual;
    CHECK(r.worst == RowKind::kNormal);
    CHECK((r.body_a == lower || r.body_b == lower));
    CHECK_FALSE(r.body_a == upper);
    CHECK(r.joint == JointId{});

    World chain(settings);
    build_chain(chain, false);
    const StepResidual joints = chain.step(kStep).diagnostics->residual;
    CHECK(joints.worst == RowKind::kJoint);
    CHECK(joints.joint.index < 5);
    CHECK(joints.max > 1e-4);  // swept once
}

TEST_CASE("joints that are solved directly leave no residual") {
    const bool touches = GENERATE(false, true);
    World world(diagnosed());
    build_chain(world, touches);
    // Contacts of the mixed solver are swept until rows change by residual_tolerance; its joints, and RATTLE's, are met by a factorisation:
    // speeds of some 10 m/s to rounding, and what a factor serves on of 1e-7 of the way.
    run(world, 0.5, kStep, [&](const StepReport& r) {
        const StepResidual& residual = r.diagnostics->residual;
        if (r.islands_of[static_cast<int>(SolverChoice::kRattle)] == 1) CHECK(residual.max < 1e-9);
        if (residual.worst == RowKind::kJoint) CHECK(residual.max < 1e-5);
    });
}

TEST_CASE("every island tells who solved it and why") {
    World world(diagnosed());
    world.add_body(ground());
    const BodyId resting = world.add_body(cube(1, {0, 0, 0.5}));
    BodyDef bouncy = ball(0.5, {9, 0, 0.5});
    bouncy.restitution = 0.5;
    world.add_body(bouncy);
    const BodyId hanging = world.add_body(cube(1, {20, 0, 5}));
    world.add_joint({JointType::kBall, hanging, BodyId{}, {20, 0, 6}});
    const BodyId held = world.add_body(cube(1, {30, 0, 0.5}));
    world.add_joint({JointType::kBall, held, BodyId{}, {30, 0, 1.5}});
    const std::vector<IslandReport>& islands = world.step(kStep).diagnostics->islands;
    REQUIRE(islands.size() == 4);
    CHECK(islands[0].first_body == resting);
    CHECK(islands[0].solver == SolverChoice::kDirect);
    CHECK(islands[0].reason == SolverReason::kContactsAlone);
    CHECK(islands[0].contacts == 4);
    CHECK(islands[0].rows == 12);
    CHECK(islands[0].fell_back_from == SolverChoice::kAuto);
    CHECK(islands[1].solver == SolverChoice::kSi);
    CHECK(islands[1].reason == SolverReason::kBounces);
    CHECK(islands[1].iterations > 0);
    CHECK(islands[2].solver == SolverChoice::kRattle);
    CHECK(islands[2].reason == SolverReason::kJointsAlone);
    CHECK(islands[2].joints == 1);
    CHECK(islands[2].rows == 3);
    CHECK(islands[3].solver == SolverChoice::kMixed);
    CHECK(islands[3].reason == SolverReason::kJointsAndContacts);
    for (const IslandReport& island : islands) {
        CHECK(island.bodies == 1);
        CHECK(island.residual.rows > 0);
    }
}

TEST_CASE("what moves together and is of like masses is swept in half the substeps, what moves alone or rests is not") {
    World world(diagnosed());
    world.add_body(ground());
    const auto push = [&](BodyDef def, Real speed) {
        def.linear_velocity = {speed, 0, 0};
        return world.add_body(def);
    };
    const BodyId pair = push(cube(1, {0, 0, 0.5}), 3), alone = push(cube(1, {0, 10, 0.5}), 3), resting = push(cube(1, {0, 20, 0.5}), 0);
    push(cube(1, {0, 0, 1.5}), 3);
    push(cube(1, {0, 20, 1.5}), 0);
    const StepReport report = world.step(kStep);
    int told = 0;
    for (const IslandReport& island : report.diagnostics->islands) {
        if (island.first_body == pair) CHECK((++told, island.solver == SolverChoice::kSi && island.substeps == 2));
        if (island.first_body == alone) CHECK((++told, island.solver == SolverChoice::kSi && island.substeps == 4));
        if (island.first_body == resting) CHECK((++told, island.solver == SolverChoice::kDirect));
    }
    CHECK(told == 3);
}

TEST_CASE("what sways is swept in half the substeps if it is low, and in all of them if it is high") {
    const int height = GENERATE(8, 9);
    CAPTURE(height);
    World world(diagnosed());
    world.add_body(ground());
    for (int k = 0; k < height; ++k) {
        BodyDef def = cube(1, {0, 0, 0.5 + k});
        def.linear_velocity = {0.3, 0, 0};  // faster than what falls in a step, slower than in four
        world.add_body(def);
    }
    const IslandReport island = world.step(kStep).diagnostics->islands.at(0);
    CHECK(island.solver == SolverChoice::kSi);
    CHECK(island.substeps == (height == 8 ? 2 : 4));
}

TEST_CASE("more than 64 bodies that move are swept in a quarter of the substeps if fast on average or low, else in all") {
    const int height = GENERATE(8, 9), fast = GENERATE(1, 6);
    CAPTURE(height, fast);
    World world(diagnosed());
    world.add_body(ground());
    for (int k = 0; k < 9 * height; ++k) {
        BodyDef def = cube(1, {1.0 * (k / height), 0, 0.5 + k % height});
        def.linear_velocity = {0, k < fast ? 3.0 : 0.3, 0};
        world.add_body(def);
    }
    const IslandReport island = world.step(kStep).diagnostics->islands.at(0);
    REQUIRE(island.bodies == 9u * height);
    CHECK(island.solver == SolverChoice::kSi);
    CHECK(island.substeps == (height == 8 || fast == 6 ? 1 : 4));
    if (island.substeps == 1) CHECK(island.iterations > 4);  // the sweeps of those left out are made in its first solve
}

TEST_CASE("what moves together and is of unlike masses is solved directly once it touches as it did a step ago") {
    World world(diagnosed());
    const auto fly = [&](BodyDef def) {
        def.linear_velocity = {3, 0, 0};
        world.add_body(def);
    };
    fly(cube(1, {0, 0, 0.5}, 1));
    fly(cube(1, {0, 0, 1.5}, 100));
    const auto first_island = [&] { return world.step(kStep).diagnostics->islands.at(0); };
    const IslandReport first = first_island();
    CHECK(first.solver == SolverChoice::kSi);
    CHECK(first.reason == SolverReason::kWaits);
    CHECK(first.substeps == 4);
    const IslandReport second = first_island();
    CHECK(second.solver == SolverChoice::kDirect);
    CHECK(second.contacts == first.contacts);
    fly(cube(1, {0.1, 0, 2.5}, 1));
    const IslandReport with_another = first_island();
    CHECK(with_another.contacts > first.contacts);
    CHECK(with_another.reason == SolverReason::kWaits);
    CHECK(first_island().solver == SolverChoice::kDirect);
}

TEST_CASE("an island that its first solver gave up tells which one that was") {
    World world(diagnosed());
    const BodyId hub = world.add_body(ball(1, {0, 0, 0}));
    // All joints of a body are neighbours: so many of them cost more than RATTLE takes (kMaxEdgesPerJoint of solver/rattle_rows.cpp).
    for (int k = 0; k < 120; ++k) {
        const Vec3 at = 3 * Vec3(std::cos(0.3 * k), std::sin(0.3 * k), 0.1 * k);
        BodyDef spoke = body(Shape::sphere(0.1), at);
        spoke.shapes.clear();
        spoke.inertia = Vec3::Constant(0.004);
        world.add_joint({JointType::kBall, hub, world.add_body(spoke), at});
    }
    const std::vector<IslandReport>& islands = world.step(kStep).diagnostics->islands;
    REQUIRE(islands.size() == 1);
    CHECK(islands[0].reason == SolverReason::kJointsAlone);
    CHECK(islands[0].fell_back_from == SolverChoice::kRattle);
    CHECK(islands[0].solver == SolverChoice::kSi);
    CHECK(islands[0].iterations > 0);
}

TEST_CASE("an island that a forced solver cannot take is told as refused") {
    World world(diagnosed(SolverChoice::kRattle));
    build_stack(world, 2);
    const StepReport r = world.step(kStep);
    REQUIRE(r.diagnostics->islands.size() == 1);
    CHECK(r.diagnostics->islands[0].is_refused);
    CHECK(r.diagnostics->islands[0].solver == SolverChoice::kRattle);
    CHECK(r.diagnostics->residual.rows == 0);
}

TEST_CASE("a model of sequential impulses is the reason for them") {
    WorldSettings settings = diagnosed();
    settings.stabilisation = Stabilisation::kTargetVelocity;
    World world(settings);
    build_stack(world, 2);
    CHECK(world.step(kStep).diagnostics->islands[0].reason == SolverReason::kModel);
}

TEST_CASE("the largest joint error and the deepest point are told with who has them") {
    World world(diagnosed());  // RATTLE brings joints together at 1 m/s
    world.add_body(ground());
    const BodyId sunk = world.add_body(cube(1, {0, 0, 0.48}));
    world.add_body(cube(1, {5, 0, 0.499}));
    const BodyId good = world.add_body(cube(1, {0, 0, 20})), torn = world.add_body(cube(1, {5, 0, 20}));
    world.add_joint({JointType::kFixed, good, BodyId{}, {0, 0, 21}});
    const JointId fixed_joint = world.add_joint({JointType::kFixed, torn, BodyId{}, {5, 0, 21}});
    BodyState s = world.state(torn);
    s.position.x() += 0.1;
    s.rotation = turn({0, 1, 0}, 0.05);
    world.set_state(torn, s);
    const StepReport r = world.step(kStep);
    const StepDiagnostics& d = *r.diagnostics;
    CHECK(d.penetration == r.max_penetration);
    CHECK(std::abs(d.penetration - 0.02) < 1e-9);
    CHECK((d.penetration_a == sunk || d.penetration_b == sunk));
    CHECK(d.joint_error_at == fixed_joint);
    CHECK(d.joint_angle_at == fixed_joint);
    CHECK(d.joint_error == world.joint_error(fixed_joint).position);
    CHECK(d.joint_angle == world.joint_error(fixed_joint).angle);
    CHECK(d.joint_error > 0.01);
}

TEST_CASE("diagnostics do not depend on the number of threads") {
    StepDiagnostics seen[2];
    for (int k = 0; k < 2; ++k) {
        WorldSettings settings = diagnosed();
        settings.threads = k + 1;
        World world = [&] {
            try {
                return World(settings);
            } catch (const std::exception&) {  // built without threads
                settings.threads = 1;
                return World(settings);
            }
        }();
        world.add_body(ground());
        for (int i = 0; i < 20; ++i) world.add_body(ball(0.4, {2.0 * i, 0, 0.4 + 0.003 * i}, 1 + i));
        for (int i = 0; i < 10; ++i) world.step(kStep);
        seen[k] = *world.step(kStep).diagnostics;
    }
    CHECK(seen[0].residual.rms == seen[1].residual.rms);
    CHECK(seen[0].residual.body_a == seen[1].residual.body_a);
    CHECK(seen[0].energy.impacts == seen[1].energy.impacts);
    CHECK(seen[0].energy.remainder == seen[1].energy.remainder);
    CHECK(seen[0].islands.size() == seen[1].islands.size());
}

TEST_CASE("a diagnosed step allocates nothing once it is warm") {
    const int scene = GENERATE(range(0, 3));
    CAPTURE(scene);
    World world(diagnosed(scene == 0 ? SolverChoice::kSi : SolverChoice::kAuto));
    if (scene == 0) build_wall(world);
    if (scene == 1) build_stack(world);
    if (scene == 2) {
        BodyId previous;
        for (int k = 0; k < 5; ++k) {
            BodyDef link = body(Shape::capsule(0.05, 0.15), {0, 0, -0.5 * k - 0.25});
            link.linear_velocity = {0.02 * k, 0, 0};
            const BodyId next = world.add_body(link);
            world.add_joint({JointType::kHinge, next, previous, {0, 0, -0.5 * k}, Vec3::Zero(), Vec3::UnitY()});
            previous = next;
        }
    }
    run(world, 0.5);
    const std::uint64_t before = allocation_count::count();
    run(world, 0.5);
    CHECK(allocation_count::count() - before == 0);
}
