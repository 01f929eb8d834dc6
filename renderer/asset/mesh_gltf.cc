// glTF 2.0 to a soup of triangles, through tinygltf. Built as a module of its own, so that scenes
// without glTF load neither tinygltf nor the C++ library.
//
// tinygltf parses the JSON and decodes data URIs; whatever refers to something else in the file (an
// index, an offset, a count) is checked here before it is followed, since the file is untrusted.
// Nothing outside the file is read. Every exception, memory running out included, ends in load().
//
// Read: triangles, strips and fans, indexed or plain, any component type, sparse accessors, node
// transforms, instancing, base colour with its texture and KHR_texture_transform; where a time is
// asked for, animations, morph targets and skins (mesh_gltf_pose.h). Left out on purpose: vertex
// colours, further textures, cameras, lights, and compressed geometry (Draco, meshopt), which is
// refused. Without a time the rest pose is drawn: geometry as it is stored.
#include "renderer/asset/mesh_gltf.h"

#include <cmath>
#include <cstdlib>
#include <map>
#include <new>
#include <vector>

#include "renderer/asset/mesh_gltf_accessor.h"
#include "renderer/asset/mesh_gltf_guard.h"
#include "renderer/asset/mesh_gltf_nodes.h"
#include "renderer/asset/mesh_gltf_pose.h"

namespace pelt {
namespace {

constexpr std::size_t SURFACES_MAX = 65535;                     // gltf_soup.surface is 16 bits wide
constexpr std::size_t IMAGE_BYTES_MAX = std::size_t(256) << 20; // encoded, all together
constexpr double POSITION_MAX = 1e30; // beyond it fp32, which pictures are drawn in, overflows
constexpr double UV_MAX = 1e9;        // beyond it the place within a tile is lost

bool file_exists(const std::string &, void *) {
    return false;
}

std::string expand_path(const std::string &path, void *) {
    return path;
}

bool read_file(std::vector<unsigned char> *, std::string *err, const std::string &path, void *) {
    if (err)
        *err += "\"" + path + "\" is outside the file";
    return false;
}

bool write_file(std::string *, const std::string &, const std::vector<unsigned char> &, void *) {
    return false;
}

// Keeps data URIs as they are encoded. Images in buffer views are looked up later: tinygltf has not
// checked that the bytes it offers here exist.
bool keep_encoded(tinygltf::Image *image, const int, std::string *, std::string *, int, int,
                  const unsigned char *bytes, int size, void *) {
    if (image->bufferView < 0 && size > 0)
        image->image.assign(bytes, bytes + size);
    return true;
}

void check_extensions(const tinygltf::Model &model) {
    for (const std::string &name : model.extensionsRequired) {
        bool known = name == "KHR_texture_transform" || name == "KHR_mesh_quantization" ||
                     name == "KHR_lights_punctual" || name.compare(0, 14, "KHR_materials_") == 0;
        if (!known)
            REFUSE("the file requires the extension %.80s, which is not supported", name.c_str());
    }
}

void parse(const unsigned char *data, std::size_t bytes, tinygltf::Model &model) {
    container file = open_container(data, bytes);
    // The JSON library's destructor takes memory, and ends the process where there is none. So that
    // there is some left, what parsing may take at most is asked for first.
    std::size_t values = check_json(file);
    ::operator delete(::operator new(values *VALUE_BYTES + 2 * bytes));
    tinygltf::TinyGLTF loader;
    loader.SetFsCallbacks({file_exists, expand_path, read_file, write_file, nullptr});
    loader.SetImageLoader(keep_encoded, nullptr);
    std::string error, warning;
    bool done =
        file.binary
            ? loader.LoadBinaryFromMemory(&model, &error, &warning, data, unsigned(bytes))
            : loader.LoadASCIIFromString(&model, &error, &warning,
                                         reinterpret_cast<const char *>(data), unsigned(bytes), "");
    if (!done) {
        // tinygltf catches what its JSON parser throws, this too, and keeps the name alone.
        if (error.find("bad_alloc") != std::string::npos)
            throw std::bad_alloc();
        for (char &c : error)
            if (c == '\n' || c == '\r')
                c = ' ';
        while (!error.empty() && error.back() == ' ')
            error.pop_back();
        if (error.find("File not found") != std::string::npos ||
            error.find("outside the file") != std::string::npos)
            REFUSE("the file refers to another file (%.200s): use .glb, or embed it as a data URI",
                   error.c_str());
        REFUSE("the file is not valid glTF: %.300s", error.c_str());
    }
    check_extensions(model);
}

// What is drawn of one primitive.
struct part {
    int mesh, primitive;
    std::uint64_t triangles;
    int mode;
    bool indexed, has_normal, has_uv;
    reader index, position, normal, uv;
    std::uint16_t surface;
    double uv_transform[6]; // u' = [0] u + [1] v + [2], v' = [3] u + [4] v + [5]
};

class converter {
  public:
    converter(tinygltf::Model &from, std::uint64_t triangles_max, const gltf_pose *at,
              gltf_soup *to)
        : model(from), limit(triangles_max), pose(at), soup(to) {}

    void run() {
        std::vector<instance> instances = find_instances(model);
        std::map<int, std::vector<part>> parts; // of each mesh that is shown, made once
        std::uint64_t total = 0;
        for (const instance &at : instances) {
            auto [entry, is_new] = parts.try_emplace(at.mesh);
            if (is_new)
                entry->second = open_mesh(at.mesh);
            for (const part &p : entry->second)
                if ((total += p.triangles) > limit)
                    refuse_as(GLTF_TOO_COMPLEX,
                              "the file has more than %llu triangles, its instances counted",
                              (unsigned long long)limit);
        }
        if (total == 0)
            REFUSE(model.meshes.empty() ? "the file has no mesh"
                                        : "the scene in the file shows no triangles");
        allocate(total);
        if (pose)
            emit_posed(instances, parts);
        else
            emit_resting(instances, parts);
        if (soup->triangle_count == 0)
            REFUSE("every triangle of the file's strips repeats a vertex");
        if (!pose)
            take_surfaces();
    }

  private:
    // What posing leaves of one primitive's vertices, in the object.
    struct deformed {
        std::vector<double> position, normal;
    };

    tinygltf::Model &model; // posing moves its nodes
    std::uint64_t limit;
    const gltf_pose *pose;
    gltf_soup *soup;
    std::map<int, reader> readers; // by accessor: opening one may cost as much as it is long
    std::map<int, std::uint16_t> surface_of_material;
    std::vector<gltf_surface> surfaces;
    std::map<int, int> image_of_texture_source;
    std::vector<int> image_sources;

    const reader &open(int accessor, int type, const char *purpose) {
        if (accessor < 0 || std::size_t(accessor) >= model.accessors.size())
            REFUSE("%s use accessor %d; there are %zu", purpose, accessor, model.accessors.size());
        int has = model.accessors[std::size_t(accessor)].type;
        if (has != type)
            REFUSE("%s use accessor %d, which has %d components instead of %d", purpose, accessor,
                   tinygltf::GetNumComponentsInType(std::uint32_t(has)),
                   tinygltf::GetNumComponentsInType(std::uint32_t(type)));
        auto known = readers.find(accessor);
        if (known == readers.end())
            known = readers.emplace(accessor, reader(model, accessor)).first;
        return known->second;
    }

    std::vector<part> open_mesh(int mesh) {
        std::vector<part> found;
        const auto &primitives = model.meshes[std::size_t(mesh)].primitives;
        for (std::size_t i = 0; i < primitives.size(); i++) {
            const tinygltf::Primitive &primitive = primitives[i];
            if (primitive.mode != TINYGLTF_MODE_TRIANGLES &&
                primitive.mode != TINYGLTF_MODE_TRIANGLE_STRIP &&
                primitive.mode != TINYGLTF_MODE_TRIANGLE_FAN)
                continue; // points and lines
            part p = open_primitive(primitive, mesh, int(i));
            if (p.triangles > 0)
                found.push_back(p);
        }
        return found;
    }

    part open_primitive(const tinygltf::Primitive &primitive, int mesh, int number) {
        part p{};
        p.mesh = mesh;
        p.primitive = number;
        p.mode = primitive.mode;
        auto attribute = [&](const std::string &name) {
            auto at = primitive.attributes.find(name);
            return at == primitive.attributes.end() ? -1 : at->second;
        };
        if (attribute("POSITION") < 0)
            REFUSE("mesh %d, primitive %d has no positions", mesh, number);
        p.position = open(attribute("POSITION"), TINYGLTF_TYPE_VEC3, "positions");
        p.has_normal = attribute("NORMAL") >= 0;
        if (p.has_normal)
            p.normal = open(attribute("NORMAL"), TINYGLTF_TYPE_VEC3, "normals");
        int uv_set = 0;
        p.surface = surface_of(primitive.material, &uv_set, p.uv_transform);
        int uv = attribute("TEXCOORD_" + std::to_string(uv_set));
        p.has_uv = uv >= 0;
        if (p.has_uv)
            p.uv = open(uv, TINYGLTF_TYPE_VEC2, "texture coordinates");
        if ((p.has_normal && p.normal.count != p.position.count) ||
            (p.has_uv && p.uv.count != p.position.count))
            REFUSE("mesh %d, primitive %d has attributes of different lengths", mesh, number);
        std::uint64_t corners = p.position.count;
        p.indexed = primitive.indices >= 0;
        if (p.indexed) {
            p.index = open(primitive.indices, TINYGLTF_TYPE_SCALAR, "indices");
            if (!p.index.unsigned_integers())
                REFUSE("mesh %d, primitive %d has indices that are not unsigned integers", mesh,
                       number);
            corners = p.index.count;
        }
        if (p.mode == TINYGLTF_MODE_TRIANGLES && corners % 3 != 0)
            REFUSE("mesh %d, primitive %d has %llu corners, which do not make triangles", mesh,
                   number, (unsigned long long)corners);
        p.triangles = p.mode == TINYGLTF_MODE_TRIANGLES ? corners / 3
                      : corners < 3                     ? 0
                                                        : corners - 2;
        return p;
    }

    static double number(const tinygltf::Value &object, const char *name, std::size_t element,
                         double otherwise) {
        if (!object.IsObject() || !object.Has(name))
            return otherwise;
        const tinygltf::Value &value = object.Get(name);
        const tinygltf::Value &at =
            value.IsArray() && value.ArrayLen() > element ? value.Get(int(element)) : value;
        return at.IsNumber() ? at.GetNumberAsDouble() : otherwise;
    }

    std::uint16_t surface_of(int material, int *uv_set, double transform[6]) {
        gltf_surface surface = {{1, 1, 1, 1}, -1};
        double t[6] = {1, 0, 0, 0, 1, 0};
        if (material >= 0) {
            if (std::size_t(material) >= model.materials.size())
                REFUSE("a primitive uses material %d; there are %zu", material,
                       model.materials.size());
            const auto &pbr = model.materials[std::size_t(material)].pbrMetallicRoughness;
            for (std::size_t c = 0; c < 4 && c < pbr.baseColorFactor.size(); c++)
                surface.base_color[c] = float(std::min(std::max(pbr.baseColorFactor[c], 0.0), 1.0));
            const tinygltf::TextureInfo &info = pbr.baseColorTexture;
            if (info.index >= 0) {
                surface.image = image_of(info.index);
                *uv_set = info.texCoord;
                auto extension = info.extensions.find("KHR_texture_transform");
                if (extension != info.extensions.end())
                    texture_transform(extension->second, uv_set, t);
            }
        }
        std::memcpy(transform, t, sizeof t);
        auto [entry, is_new] =
            surface_of_material.try_emplace(material, std::uint16_t(surfaces.size()));
        if (is_new) {
            if (surfaces.size() >= SURFACES_MAX)
                refuse_as(GLTF_TOO_COMPLEX, "the file uses more than %zu materials", SURFACES_MAX);
            surfaces.push_back(surface);
        }
        return entry->second;
    }

    // uv' = offset + rotation * (scale * uv), counter-clockwise as seen with v downwards.
    static void texture_transform(const tinygltf::Value &value, int *uv_set, double t[6]) {
        double sx = number(value, "scale", 0, 1), sy = number(value, "scale", 1, 1);
        double angle = number(value, "rotation", 0, 0);
        double c = std::cos(angle), s = std::sin(angle);
        t[0] = c * sx;
        t[1] = s * sy;
        t[2] = number(value, "offset", 0, 0);
        t[3] = -s * sx;
        t[4] = c * sy;
        t[5] = number(value, "offset", 1, 0);
        double set = number(value, "texCoord", 0, *uv_set);
        if (set >= 0 && set < 1024)
            *uv_set = int(set);
    }

    int image_of(int texture) {
        if (std::size_t(texture) >= model.textures.size())
            REFUSE("a material uses texture %d; there are %zu", texture, model.textures.size());
        int source = model.textures[std::size_t(texture)].source;
        if (source >= 0 && std::size_t(source) >= model.images.size())
            REFUSE("texture %d uses image %d; there are %zu", texture, source, model.images.size());
        auto [entry, is_new] =
            image_of_texture_source.try_emplace(source, int(image_sources.size()));
        if (is_new)
            image_sources.push_back(source);
        return entry->second;
    }

    template <typename T> static T *allocate_array(std::uint64_t count) {
        T *array = static_cast<T *>(std::calloc(std::size_t(count), sizeof(T)));
        if (!array)
            throw std::bad_alloc();
        return array;
    }

    void allocate(std::uint64_t triangles) {
        soup->position = allocate_array<double[3]>(3 * triangles);
        soup->normal = allocate_array<float[3]>(3 * triangles);
        soup->has_normal = allocate_array<std::uint8_t>(triangles);
        if (pose)
            return;
        soup->uv = allocate_array<double[2]>(3 * triangles);
        soup->has_uv = allocate_array<std::uint8_t>(triangles);
        soup->surface = allocate_array<std::uint16_t>(triangles);
    }

    static std::uint64_t vertex_of(const part &p, std::uint64_t corner) {
        std::uint64_t vertex = corner;
        if (p.indexed) {
            double value;
            p.index.read(std::size_t(corner), &value);
            vertex = std::uint64_t(value);
        }
        if (vertex >= p.position.count)
            REFUSE("mesh %d, primitive %d: index %llu is vertex %llu; there are %zu", p.mesh,
                   p.primitive, (unsigned long long)corner, (unsigned long long)vertex,
                   p.position.count);
        return vertex;
    }

    void emit_resting(const std::vector<instance> &instances,
                      std::map<int, std::vector<part>> &parts) {
        soup->part_end = allocate_array<std::uint64_t>(instances.size());
        for (const instance &at : instances) {
            for (const part &p : parts[at.mesh])
                emit(p, at, nullptr);
            soup->part_end[soup->part_count++] = soup->triangle_count;
        }
    }

    // The order of a triangle's corners is that of the rest pose, whatever becomes of them: a mesh
    // keeps its topology.
    void emit_posed(const std::vector<instance> &rest, std::map<int, std::vector<part>> &parts) {
        poser poser(model, pose->animation ? pose->animation : "", pose->time_s);
        std::vector<matrix> globals;
        std::vector<bool> in_scene;
        std::vector<instance> posed = find_instances(model, &globals, &in_scene);
        poser.place(std::move(globals), std::move(in_scene));
        for (std::size_t i = 0; i < rest.size(); i++)
            for (const part &p : parts[rest[i].mesh]) {
                char where[64];
                std::snprintf(where, sizeof where, "mesh %d, primitive %d", p.mesh, p.primitive);
                deformed now;
                poser.deform(model.meshes[std::size_t(p.mesh)].primitives[std::size_t(p.primitive)],
                             where, posed[i].node, posed[i].object_from_mesh, p.position,
                             p.has_normal ? &p.normal : nullptr, now.position, now.normal);
                emit(p, rest[i], &now);
            }
    }

    void emit(const part &p, const instance &at, const deformed *now) {
        const matrix &m = at.object_from_mesh;
        // Normals go by the cofactors of the linear part: its inverse transpose times the
        // determinant, which exists for flattening transforms too; the sign is taken out again.
        double cofactor[9];
        double determinant = poser::cofactors(m, cofactor);
        bool mirrored = determinant < 0;
        for (std::uint64_t t = 0; t < p.triangles; t++) {
            std::uint64_t corner[3] = {3 * t, 3 * t + 1, 3 * t + 2};
            if (p.mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
                corner[0] = t;
                corner[1] = t + 1 + t % 2;
                corner[2] = t + 2 - t % 2;
            } else if (p.mode == TINYGLTF_MODE_TRIANGLE_FAN) {
                corner[0] = t + 1;
                corner[1] = t + 2;
                corner[2] = 0;
            }
            std::uint64_t vertex[3];
            for (int k = 0; k < 3; k++)
                vertex[k] = vertex_of(p, corner[k]);
            // Strips repeat vertices on purpose, to jump.
            if (p.mode == TINYGLTF_MODE_TRIANGLE_STRIP &&
                (vertex[0] == vertex[1] || vertex[1] == vertex[2] || vertex[2] == vertex[0]))
                continue;
            if (mirrored)
                std::swap(vertex[1], vertex[2]);
            emit_triangle(p, at, vertex, cofactor, mirrored ? -1 : 1, now);
        }
    }

    void emit_triangle(const part &p, const instance &at, const std::uint64_t vertex[3],
                       const double cofactor[9], double sign, const deformed *now) {
        std::uint64_t t = soup->triangle_count++;
        const matrix &m = at.object_from_mesh;
        bool uv_usable = p.has_uv;
        for (std::size_t k = 0; k < 3; k++) {
            std::size_t i = std::size_t(vertex[k]), to = std::size_t(3 * t) + k;
            double v[3] = {0, 0, 0};
            p.position.read(i, v);
            for (std::size_t r = 0; r < 3; r++) {
                double x = now ? now->position[3 * i + r]
                               : m[r] * v[0] + m[4 + r] * v[1] + m[8 + r] * v[2] + m[12 + r];
                if (!(std::fabs(x) <= POSITION_MAX))
                    REFUSE("mesh %d, primitive %d: the position of vertex %zu %s", p.mesh,
                           p.primitive, i,
                           std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2])
                               ? "is too far away once its node's transform is applied"
                               : "is not a finite number");
                soup->position[to][r] = x;
            }
            if (p.has_normal) {
                p.normal.read(i, v);
                double n[3], largest = 0;
                for (std::size_t r = 0; r < 3; r++) {
                    n[r] = now ? now->normal[3 * i + r]
                               : sign * (cofactor[r] * v[0] + cofactor[3 + r] * v[1] +
                                         cofactor[6 + r] * v[2]);
                    largest = std::max(largest, std::fabs(n[r]));
                }
                // Into the range of fp32; what has no direction stays zero, which means "none".
                for (std::size_t r = 0; r < 3; r++)
                    soup->normal[to][r] =
                        largest > 0 && std::isfinite(largest) && std::isfinite(n[r])
                            ? float(n[r] / largest)
                            : 0;
            }
            if (p.has_uv && !now) {
                p.uv.read(i, v);
                const double *a = p.uv_transform;
                soup->uv[to][0] = a[0] * v[0] + a[1] * v[1] + a[2];
                soup->uv[to][1] = a[3] * v[0] + a[4] * v[1] + a[5];
                uv_usable = uv_usable && std::fabs(soup->uv[to][0]) <= UV_MAX &&
                            std::fabs(soup->uv[to][1]) <= UV_MAX;
            }
        }
        soup->has_normal[t] = p.has_normal;
        if (now)
            return;
        soup->has_uv[t] = uv_usable;
        soup->surface[t] = p.surface;
    }

    void take_surfaces() {
        soup->surfaces = allocate_array<gltf_surface>(surfaces.size());
        soup->surface_count = std::uint32_t(surfaces.size());
        std::copy(surfaces.begin(), surfaces.end(), soup->surfaces);
        if (image_sources.empty())
            return;
        soup->images = allocate_array<gltf_image>(image_sources.size());
        soup->image_count = std::uint32_t(image_sources.size());
        std::size_t total = 0;
        for (std::size_t i = 0; i < image_sources.size(); i++) {
            if (image_sources[i] < 0)
                continue; // only an extension names the image: no bytes
            const tinygltf::Image &image = model.images[std::size_t(image_sources[i])];
            const unsigned char *data = image.image.data();
            std::size_t bytes = image.image.size();
            if (image.bufferView >= 0) {
                data = view_bytes(model, image.bufferView, 0, 0, "image", image_sources[i]);
                bytes = model.bufferViews[std::size_t(image.bufferView)].byteLength;
            }
            total += bytes;
            if (total > IMAGE_BYTES_MAX)
                refuse_as(GLTF_TOO_COMPLEX, "the textures have more than %zu bytes together",
                          IMAGE_BYTES_MAX);
            if (bytes == 0)
                continue; // another file: no bytes
            soup->images[i].data = allocate_array<unsigned char>(bytes);
            soup->images[i].bytes = bytes;
            std::memcpy(soup->images[i].data, data, bytes);
        }
    }
};

void free_soup(gltf_soup *soup) {
    for (std::uint32_t i = 0; i < soup->image_count; i++)
        std::free(soup->images[i].data);
    std::free(soup->images);
    std::free(soup->surfaces);
    std::free(soup->position);
    std::free(soup->normal);
    std::free(soup->uv);
    std::free(soup->has_normal);
    std::free(soup->has_uv);
    std::free(soup->surface);
    std::free(soup->part_end);
    *soup = gltf_soup{};
}

gltf_outcome load_soup(const unsigned char *data, std::size_t bytes, std::uint64_t triangles_max,
                       const gltf_pose *pose, gltf_soup *soup, char *message,
                       std::size_t message_bytes) {
    *soup = gltf_soup{};
    gltf_outcome outcome = GLTF_OK;
    try {
        tinygltf::Model model;
        parse(data, bytes, model);
        converter(model, triangles_max, pose, soup).run();
    } catch (const refusal &why) {
        outcome = why.outcome;
        std::snprintf(message, message_bytes, "%s", why.what());
    } catch (const std::bad_alloc &) {
        outcome = GLTF_OUT_OF_MEMORY;
        std::snprintf(message, message_bytes, "no memory to read the file");
    } catch (const std::exception &why) {
        outcome = GLTF_BAD;
        std::snprintf(message, message_bytes, "the file is not valid glTF (%s)", why.what());
    } catch (...) {
        outcome = GLTF_BAD;
        std::snprintf(message, message_bytes, "the file is not valid glTF");
    }
    if (outcome != GLTF_OK)
        free_soup(soup);
    return outcome;
}

const char *library_version() {
    return "tinygltf " PELT_TINYGLTF_VERSION;
}

} // namespace
} // namespace pelt

extern "C" __attribute__((visibility("default"))) const gltf_module pelt_mesh_module;
const gltf_module pelt_mesh_module = {pelt::load_soup, pelt::free_soup, pelt::library_version};
