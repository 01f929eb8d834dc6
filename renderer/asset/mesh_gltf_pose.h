// What a glTF file looks like at one time of one of its animations: nodes moved, morph targets
// weighted, skins bent.
//
// glTF 2.0, 3.7.2.2 (morph targets), 3.7.3 (skins), 3.11 and appendix C (animations): a channel's
// sampler is clamped to its first and last key; LINEAR turns rotations along the shorter arc;
// CUBICSPLINE is Hermite with tangents times the step. A skinned vertex is
// sum_i w_i globalJoint_i inverseBind_i p, whatever its node's own transform. Files hold weights
// that do not sum to 1 by rounding or by mistake: they are divided by their sum; a sum of 0, or a
// weight that is negative or no number, is refused.
//
// The file is untrusted: every index is checked, what is read is finite, and the work is capped.
#ifndef PELT_RENDERER_ASSET_MESH_GLTF_POSE_H
#define PELT_RENDERER_ASSET_MESH_GLTF_POSE_H

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "renderer/asset/mesh_gltf_accessor.h"
#include "renderer/asset/mesh_gltf_nodes.h"

namespace pelt {

// Vertices times what each is blended from, of all instances together: some seconds.
constexpr std::uint64_t BLENDS_MAX = std::uint64_t(1) << 28;
constexpr std::size_t INFLUENCE_SETS_MAX = 4; // of four joints each

class poser {
  public:
    poser(tinygltf::Model &of, std::string name, double at) : model(of), time(at) {
        if (model.animations.empty())
            refuse_as(GLTF_NO_ANIMATION, "the file has no animation");
        std::string names;
        for (std::size_t i = 0; i < model.animations.size(); i++) {
            if (name.empty() || model.animations[i].name == name) {
                animate(model.animations[i], i);
                return;
            }
            if (names.size() < 200)
                names += (names.empty() ? "" : ", ") + model.animations[i].name.substr(0, 60);
        }
        refuse_as(GLTF_NO_ANIMATION, "the file has no animation of that name, but %s",
                  names.c_str());
    }

    // Once the nodes are posed: where every node of the scene is.
    void place(std::vector<matrix> globals, std::vector<bool> in_scene) {
        object_from_node = std::move(globals);
        seen = std::move(in_scene);
    }

    // Positions and normals (empty where the primitive has none) of all vertices, in the object.
    void deform(const tinygltf::Primitive &primitive, const char *where, int node,
                const matrix &object_from_mesh, const reader &position, const reader *normal,
                std::vector<double> &p, std::vector<double> &n) {
        const tinygltf::Node *of = node >= 0 ? &model.nodes[std::size_t(node)] : nullptr;
        std::size_t count = position.count;
        std::vector<target> targets = open_targets(primitive, where, of, count);
        std::vector<reader> joints, weights;
        const std::vector<matrix> *bones = nullptr;
        if (of && of->skin >= 0) {
            bones = &open_skin(of->skin);
            open_influences(primitive, where, count, joints, weights);
        }
        std::uint64_t each = 1 + targets.size() + 4 * joints.size();
        if (count > BLENDS_MAX / each || (blends += count * each) > BLENDS_MAX)
            refuse_as(GLTF_TOO_COMPLEX, "%s: more than %llu vertices times targets and joints",
                      where, (unsigned long long)BLENDS_MAX);
        p.resize(3 * count);
        n.resize(normal ? 3 * count : 0);
        for (std::size_t i = 0; i < count; i++) {
            double v[3], w[3] = {0, 0, 0};
            position.read(i, v);
            if (normal)
                normal->read(i, w);
            for (const target &t : targets) {
                double d[3];
                if (t.has_position) {
                    t.position.read(i, d);
                    for (int c = 0; c < 3; c++)
                        v[c] += t.weight * d[c];
                }
                if (normal && t.has_normal) {
                    t.normal.read(i, d);
                    for (int c = 0; c < 3; c++)
                        w[c] += t.weight * d[c];
                }
            }
            matrix m =
                bones ? blend(*bones, joints, weights, i, where, of->skin) : object_from_mesh;
            for (std::size_t r = 0; r < 3; r++)
                p[3 * i + r] = m[r] * v[0] + m[4 + r] * v[1] + m[8 + r] * v[2] + m[12 + r];
            if (normal)
                turn(m, w, &n[3 * i]);
        }
    }

    // The cofactors of a linear part, which take normals along but for the sign of the determinant.
    static double cofactors(const matrix &m, double cofactor[9]) {
        for (std::size_t c = 0; c < 3; c++)
            for (std::size_t r = 0; r < 3; r++) {
                std::size_t c1 = (c + 1) % 3 * 4, c2 = (c + 2) % 3 * 4;
                std::size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3;
                cofactor[c * 3 + r] = m[c1 + r1] * m[c2 + r2] - m[c1 + r2] * m[c2 + r1];
            }
        return m[0] * cofactor[0] + m[1] * cofactor[1] + m[2] * cofactor[2];
    }

  private:
    struct target {
        double weight;
        bool has_position, has_normal;
        reader position, normal;
    };

    tinygltf::Model &model;
    double time;
    std::uint64_t blends = 0;
    std::map<int, reader> inputs; // proven to be in order
    std::map<int, std::vector<matrix>> skins;
    std::vector<matrix> object_from_node;
    std::vector<bool> seen;

    reader open(int accessor, int type, const char *purpose) const {
        if (accessor < 0 || std::size_t(accessor) >= model.accessors.size())
            REFUSE("%s use accessor %d; there are %zu", purpose, accessor, model.accessors.size());
        if (model.accessors[std::size_t(accessor)].type != type)
            REFUSE("%s use accessor %d, which is of another type", purpose, accessor);
        return reader(model, accessor);
    }

    // ---- animation ----

    const reader &open_times(int accessor) {
        auto known = inputs.find(accessor);
        if (known != inputs.end())
            return known->second;
        reader times = open(accessor, TINYGLTF_TYPE_SCALAR, "an animation's times");
        if (times.count == 0)
            REFUSE("accessor %d: an animation without keys", accessor);
        double before = -INFINITY, at;
        for (std::size_t i = 0; i < times.count; i++, before = at) {
            times.read(i, &at);
            if (!std::isfinite(at) || at <= before)
                REFUSE("accessor %d: key %zu of an animation is not later than the one before",
                       accessor, i);
        }
        return inputs.emplace(accessor, times).first->second;
    }

    // The key at or before the time, and how far it is to the next one, in [0, 1).
    std::size_t find_key(const reader &times, double &part, double &step) const {
        double first, last;
        times.read(0, &first);
        times.read(times.count - 1, &last);
        part = step = 0;
        if (time <= first)
            return 0;
        if (time >= last)
            return times.count - 1;
        std::size_t low = 0, high = times.count - 1;
        while (high - low > 1) {
            std::size_t middle = low + (high - low) / 2;
            double at;
            times.read(middle, &at);
            (at <= time ? low : high) = middle;
        }
        double a, b;
        times.read(low, &a);
        times.read(high, &b);
        step = b - a;
        part = (time - a) / step;
        return low;
    }

    void animate(const tinygltf::Animation &animation, std::size_t number) {
        for (const tinygltf::AnimationChannel &channel : animation.channels) {
            if (channel.target_node < 0)
                continue; // an extension's
            if (std::size_t(channel.target_node) >= model.nodes.size())
                REFUSE("animation %zu moves node %d; there are %zu", number, channel.target_node,
                       model.nodes.size());
            if (channel.sampler < 0 || std::size_t(channel.sampler) >= animation.samplers.size())
                REFUSE("animation %zu uses sampler %d; there are %zu", number, channel.sampler,
                       animation.samplers.size());
            apply(animation.samplers[std::size_t(channel.sampler)], channel);
        }
    }

    void apply(const tinygltf::AnimationSampler &sampler,
               const tinygltf::AnimationChannel &channel) {
        tinygltf::Node &node = model.nodes[std::size_t(channel.target_node)];
        const std::string &path = channel.target_path;
        bool weights = path == "weights", turns = path == "rotation";
        if (!weights && !turns && path != "translation" && path != "scale")
            return; // an extension's
        if (!weights && !node.matrix.empty())
            REFUSE("node %d has a matrix and is animated", channel.target_node);
        const reader &times = open_times(sampler.input);
        bool cubic = sampler.interpolation == "CUBICSPLINE";
        bool step = sampler.interpolation == "STEP";
        if (!cubic && !step && sampler.interpolation != "LINEAR")
            REFUSE("an animation interpolates by %.40s, which glTF does not know",
                   sampler.interpolation.c_str());
        std::size_t width = weights ? weight_count(node, channel.target_node) : 1;
        reader values = open(sampler.output,
                             weights ? TINYGLTF_TYPE_SCALAR
                             : turns ? TINYGLTF_TYPE_VEC4
                                     : TINYGLTF_TYPE_VEC3,
                             "an animation's values");
        std::uint64_t wanted = std::uint64_t(times.count) * width * (cubic ? 3 : 1);
        if (values.count != wanted)
            REFUSE("accessor %d: an animation has %zu values for %zu keys, not %llu",
                   sampler.output, values.count, times.count, (unsigned long long)wanted);
        double part, length;
        std::size_t key = find_key(times, part, length);
        std::size_t numbers = weights ? width : turns ? 4 : 3;
        std::vector<double> a = row(values, key, width, cubic, 1, numbers), to = a;
        if (part > 0 && !step) {
            std::vector<double> b = row(values, key + 1, width, cubic, 1, numbers);
            if (cubic)
                to = hermite(a, b, row(values, key, width, true, 2, numbers),
                             row(values, key + 1, width, true, 0, numbers), part, length);
            else if (turns)
                to = turn_between(a, b, part);
            else
                for (std::size_t i = 0; i < numbers; i++)
                    to[i] = (1 - part) * a[i] + part * b[i];
        }
        for (double x : to)
            if (!std::isfinite(x))
                REFUSE("accessor %d: an animation has a value that is no finite number",
                       sampler.output);
        (weights                 ? node.weights
         : turns                 ? node.rotation
         : path == "translation" ? node.translation
                                 : node.scale) = to;
    }

    std::size_t weight_count(const tinygltf::Node &node, int number) const {
        if (node.mesh < 0 || std::size_t(node.mesh) >= model.meshes.size())
            REFUSE("an animation weights the targets of node %d, which has no mesh", number);
        const auto &primitives = model.meshes[std::size_t(node.mesh)].primitives;
        return primitives.empty() ? 0 : primitives[0].targets.size();
    }

    // One key's numbers; `third` of a cubic key's three: tangent in, value, tangent out.
    static std::vector<double> row(const reader &values, std::size_t key, std::size_t width,
                                   bool cubic, std::size_t third, std::size_t numbers) {
        std::vector<double> to(numbers);
        std::size_t first = cubic ? (3 * key + third) * width : key * width;
        if (width == 1 && numbers > 1)
            values.read(first, to.data());
        else
            for (std::size_t i = 0; i < width; i++)
                values.read(first + i, &to[i]);
        return to;
    }

    static std::vector<double> hermite(const std::vector<double> &a, const std::vector<double> &b,
                                       const std::vector<double> &out,
                                       const std::vector<double> &in, double s, double step) {
        double s2 = s * s, s3 = s2 * s;
        std::vector<double> to(a.size());
        for (std::size_t i = 0; i < a.size(); i++)
            to[i] = (2 * s3 - 3 * s2 + 1) * a[i] + step * (s3 - 2 * s2 + s) * out[i] +
                    (3 * s2 - 2 * s3) * b[i] + step * (s3 - s2) * in[i];
        return to;
    }

    // Along the shorter arc; the angle from half-lengths, which tells small ones apart.
    static std::vector<double> turn_between(std::vector<double> a, std::vector<double> b,
                                            double s) {
        double dot = 0, apart = 0, together = 0;
        for (std::size_t i = 0; i < 4; i++)
            dot += a[i] * b[i];
        for (std::size_t i = 0; i < 4; i++) {
            b[i] = dot < 0 ? -b[i] : b[i];
            apart += (b[i] - a[i]) * (b[i] - a[i]);
            together += (b[i] + a[i]) * (b[i] + a[i]);
        }
        double angle = 2 * std::atan2(std::sqrt(apart), std::sqrt(together));
        double sine = std::sin(angle);
        double from = sine > 0 ? std::sin((1 - s) * angle) / sine : 1;
        double to = sine > 0 ? std::sin(s * angle) / sine : 0;
        for (std::size_t i = 0; i < 4; i++)
            a[i] = from * a[i] + to * b[i];
        return a;
    }

    // ---- morph targets ----

    std::vector<target> open_targets(const tinygltf::Primitive &primitive, const char *where,
                                     const tinygltf::Node *node, std::size_t count) const {
        std::vector<target> found;
        const std::vector<double> *weights = node && !node->weights.empty() ? &node->weights
                                             : node && node->mesh >= 0
                                                 ? &model.meshes[std::size_t(node->mesh)].weights
                                                 : nullptr;
        for (std::size_t i = 0; weights && i < primitive.targets.size() && i < weights->size();
             i++) {
            target t{(*weights)[i], false, false, {}, {}};
            if (!std::isfinite(t.weight))
                REFUSE("%s: the weight of target %zu is no finite number", where, i);
            if (t.weight == 0)
                continue;
            t.has_position =
                open_target(primitive.targets[i], "POSITION", where, count, t.position);
            t.has_normal = open_target(primitive.targets[i], "NORMAL", where, count, t.normal);
            found.push_back(t);
        }
        return found;
    }

    bool open_target(const std::map<std::string, int> &attributes, const char *name,
                     const char *where, std::size_t count, reader &to) const {
        auto at = attributes.find(name);
        if (at == attributes.end())
            return false;
        to = open(at->second, TINYGLTF_TYPE_VEC3, "morph targets");
        if (to.count != count)
            REFUSE("%s: a target has %zu vertices, not %zu", where, to.count, count);
        return true;
    }

    // ---- skins ----

    const std::vector<matrix> &open_skin(int index) {
        auto known = skins.find(index);
        if (known != skins.end())
            return known->second;
        if (std::size_t(index) >= model.skins.size())
            REFUSE("a node uses skin %d; there are %zu", index, model.skins.size());
        const tinygltf::Skin &skin = model.skins[std::size_t(index)];
        if (skin.joints.empty())
            REFUSE("skin %d has no joints", index);
        reader bind;
        bool bound = skin.inverseBindMatrices >= 0;
        if (bound) {
            bind = open(skin.inverseBindMatrices, TINYGLTF_TYPE_MAT4, "inverse bind matrices");
            if (bind.count < skin.joints.size())
                REFUSE("skin %d has %zu joints and %zu inverse bind matrices", index,
                       skin.joints.size(), bind.count);
        }
        std::vector<matrix> bones;
        for (std::size_t i = 0; i < skin.joints.size(); i++) {
            int joint = skin.joints[i];
            if (joint < 0 || std::size_t(joint) >= model.nodes.size() || !seen[std::size_t(joint)])
                REFUSE("skin %d has node %d for a joint, which the scene does not have", index,
                       joint);
            matrix m = IDENTITY;
            if (bound)
                bind.read(i, m.data());
            m[3] = m[7] = m[11] = 0; // some exporters leave rounding there
            m[15] = 1;
            bones.push_back(multiply(object_from_node[std::size_t(joint)], m));
            for (double x : bones.back())
                if (!std::isfinite(x))
                    REFUSE("skin %d, joint %zu: the matrix has a number that is not finite", index,
                           i);
        }
        return skins.emplace(index, std::move(bones)).first->second;
    }

    void open_influences(const tinygltf::Primitive &primitive, const char *where, std::size_t count,
                         std::vector<reader> &joints, std::vector<reader> &weights) const {
        for (std::size_t set = 0; set <= INFLUENCE_SETS_MAX; set++) {
            auto joint = primitive.attributes.find("JOINTS_" + std::to_string(set));
            auto weight = primitive.attributes.find("WEIGHTS_" + std::to_string(set));
            bool has_joint = joint != primitive.attributes.end();
            bool has_weight = weight != primitive.attributes.end();
            if (has_joint != has_weight || (set == 0 && !has_joint))
                REFUSE("%s: a skin needs joints and weights", where);
            if (!has_joint)
                return;
            if (set == INFLUENCE_SETS_MAX)
                refuse_as(GLTF_TOO_COMPLEX, "%s: more than %zu joints at a vertex", where,
                          4 * INFLUENCE_SETS_MAX);
            joints.push_back(open(joint->second, TINYGLTF_TYPE_VEC4, "joints"));
            weights.push_back(open(weight->second, TINYGLTF_TYPE_VEC4, "weights"));
            if (!joints.back().unsigned_integers())
                REFUSE("%s: joints that are not unsigned integers", where);
            if (joints.back().count != count || weights.back().count != count)
                REFUSE("%s has attributes of different lengths", where);
        }
    }

    static matrix blend(const std::vector<matrix> &bones, const std::vector<reader> &joints,
                        const std::vector<reader> &weights, std::size_t vertex, const char *where,
                        int skin) {
        matrix m{};
        double sum = 0;
        for (std::size_t set = 0; set < joints.size(); set++) {
            double joint[4], weight[4];
            joints[set].read(vertex, joint);
            weights[set].read(vertex, weight);
            for (std::size_t k = 0; k < 4; k++) {
                if (!(weight[k] >= 0) || !std::isfinite(weight[k]))
                    REFUSE("%s, vertex %zu: a weight is negative or no finite number", where,
                           vertex);
                if (weight[k] == 0)
                    continue; // whatever its joint
                if (joint[k] >= double(bones.size()))
                    REFUSE("%s, vertex %zu follows joint %.0f of skin %d, which has %zu", where,
                           vertex, joint[k], skin, bones.size());
                sum += weight[k];
                const matrix &bone = bones[std::size_t(joint[k])];
                for (std::size_t i = 0; i < 16; i++)
                    m[i] += weight[k] * bone[i];
            }
        }
        if (sum == 0)
            REFUSE("%s, vertex %zu: the weights sum to 0", where, vertex);
        for (double &x : m)
            x /= sum;
        return m;
    }

    static void turn(const matrix &m, const double n[3], double to[3]) {
        double cofactor[9];
        double sign = cofactors(m, cofactor) < 0 ? -1 : 1;
        for (std::size_t r = 0; r < 3; r++)
            to[r] = sign * (cofactor[r] * n[0] + cofactor[3 + r] * n[1] + cofactor[6 + r] * n[2]);
    }
};

} // namespace pelt

#endif
