#include "apps/cli/random.hpp"
#include "apps/cli/scene_writer.hpp"

#include <cmath>
#include <string>

namespace cairn::cli {

void fill_ragdolls(SceneWriter& scene, int count, Random& random);

namespace {

// One figure, upright about its hips in its own frame: x forward, y to the left, z up.
class Figure {
public:
    Figure(SceneWriter& scene, const std::string& prefix, const Vec3& hips, const Quat& turn)
        : scene_(scene), prefix_(prefix), X_{turn, hips} {}

    void build() {
        part("hips", 11, {0, 0, 0}, box_shape({0.1, 0.16, 0.1}));
        part("chest", 18, {0, 0, 0.33}, box_shape({0.12, 0.19, 0.2}));
        part("head", 4.5, {0, 0, 0.7}, sphere_shape(0.12));
        link("ball", "hips", "chest", {0, 0, 0.115});
        link("ball", "chest", "head", {0, 0, 0.555});
        for (const int side : {-1, 1}) {
            const std::string s = side < 0 ? "_right" : "_left";
            // Arms reach sideways, legs hang down.
            part("upper_arm" + s, 2.2, {0, side * 0.37, 0.46}, capsule_shape(0.05, 0.1), true);
            part("forearm" + s, 1.5, {0, side * 0.68, 0.46}, capsule_shape(0.045, 0.1), true);
            part("thigh" + s, 8, {0, side * 0.09, -0.34}, capsule_shape(0.075, 0.14));
            part("shin" + s, 4, {0, side * 0.09, -0.77}, capsule_shape(0.06, 0.14));
            link("ball", "chest", "upper_arm" + s, {0, side * 0.205, 0.46});
            link("hinge", "upper_arm" + s, "forearm" + s, {0, side * 0.53, 0.46}, Vec3::UnitZ());
            link("ball", "hips", "thigh" + s, {0, side * 0.09, -0.11});
            link("hinge", "thigh" + s, "shin" + s, {0, side * 0.09, -0.56}, Vec3::UnitY());
        }
    }

private:
    void part(const std::string& name, Real mass, const Vec3& at, const OrderedJson& shape, bool sideways = false) {
        const Quat lying = sideways ? Quat(std::sqrt(0.5), std::sqrt(0.5), 0, 0) : Quat(1, 0, 0, 0);
        scene_.dynamic(prefix_ + name, mass, X_.q * at + X_.p, shape, X_.q * lying)["friction"] = 0.6;
    }
    void link(const char* type, const std::string& a, const std::string& b, const Vec3& at, const Vec3& axis = Vec3::Zero()) {
        OrderedJson& joint = scene_.joint(type, prefix_ + a, prefix_ + b, X_.q * at + X_.p);
        if (!axis.isZero(0)) joint["axis"] = rounded(X_.q * axis);
    }

    SceneWriter& scene_;
    std::string prefix_;
    Pose X_;
};

}  // namespace

// Figures in rows, at different heights, leaning and turned at random.
void fill_ragdolls(SceneWriter& scene, int count, Random& random) {
    scene.ground(0.6);
    int side = 1;
    while (side * side < count) ++side;
    for (int k = 0; k < count; ++k) {
        const Vec3 hips(2.2 * (k % side - (side - 1) / 2.0), 2.2 * (k / side - (side - 1) / 2.0), random.uniform(1.6, 2.6));
        // A third of the way to a random rotation, by the straight way through the quaternions: no angle, so no library's sine.
        const Quat q = random.rotation();
        const Quat lean = Quat(std::abs(q.w()) + 1.5, q.x(), q.y(), q.z()).normalized();
        Figure(scene, "figure" + std::to_string(k) + "_", hips, lean).build();
    }
}

}  // namespace cairn::cli
