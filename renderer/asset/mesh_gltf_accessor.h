// Accessors: how glTF lays numbers into buffers, read with every bound checked.
//
// A reader is made once for each accessor; making it proves that all of its elements, those of its
// sparse part included, lie inside their buffer views and those inside their buffers. Elements are
// converted when they are asked for, so that a count of billions costs nothing until someone has
// the bytes for it.
#ifndef PELT_RENDERER_ASSET_MESH_GLTF_ACCESSOR_H
#define PELT_RENDERER_ASSET_MESH_GLTF_ACCESSOR_H

#include <tiny_gltf.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "renderer/asset/mesh_gltf_guard.h"

namespace pelt {

// `bytes` bytes at `offset` of a buffer view.
inline const unsigned char *view_bytes(const tinygltf::Model &model, int view, std::uint64_t offset,
                                       std::uint64_t bytes, const char *what, int index) {
    if (view < 0 || std::size_t(view) >= model.bufferViews.size())
        REFUSE("%s %d uses buffer view %d; there are %zu", what, index, view,
               model.bufferViews.size());
    const tinygltf::BufferView &v = model.bufferViews[std::size_t(view)];
    if (v.buffer < 0 || std::size_t(v.buffer) >= model.buffers.size())
        REFUSE("buffer view %d uses buffer %d; there are %zu", view, v.buffer,
               model.buffers.size());
    const std::vector<unsigned char> &data = model.buffers[std::size_t(v.buffer)].data;
    if (v.byteOffset > data.size() || v.byteLength > data.size() - v.byteOffset)
        REFUSE("buffer view %d reaches past the end of buffer %d: %zu bytes from byte %zu of %zu",
               view, v.buffer, v.byteLength, v.byteOffset, data.size());
    if (offset > v.byteLength || bytes > v.byteLength - offset)
        REFUSE("%s %d reaches past the end of buffer view %d: %llu bytes from byte %llu of %zu",
               what, index, view, (unsigned long long)bytes, (unsigned long long)offset,
               v.byteLength);
    return data.data() + v.byteOffset + offset;
}

inline std::size_t component_bytes(int type) {
    switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return 4;
    default:
        return 0; // glTF has no others
    }
}

template <typename T> T load(const unsigned char *p) {
    T value; // buffers promise no alignment
    std::memcpy(&value, p, sizeof value);
    return value;
}

// glTF 3.11: normalized integers are value / max, signed ones not below -1.
inline double component(const unsigned char *p, int type, bool normalized) {
    switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
        double value = load<std::int8_t>(p);
        return normalized ? std::max(value / 127, -1.0) : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return normalized ? *p / 255.0 : *p;
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
        double value = load<std::int16_t>(p);
        return normalized ? std::max(value / 32767, -1.0) : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
        double value = load<std::uint16_t>(p);
        return normalized ? value / 65535 : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return load<std::uint32_t>(p);
    default:
        return double(load<float>(p));
    }
}

class reader {
  public:
    reader() = default;

    // Of accessor `index`, which exists.
    reader(const tinygltf::Model &model, int index) {
        const tinygltf::Accessor &a = model.accessors[std::size_t(index)];
        component_size = component_bytes(a.componentType);
        if (component_size == 0)
            REFUSE("accessor %d has the component type %d, which glTF does not know", index,
                   a.componentType);
        count = a.count;
        components = tinygltf::GetNumComponentsInType(std::uint32_t(a.type));
        component_type = a.componentType;
        normalized = a.normalized;
        std::size_t size = component_size * std::size_t(components);
        stride = size;
        if (a.bufferView >= 0) {
            if (std::size_t(a.bufferView) < model.bufferViews.size() &&
                model.bufferViews[std::size_t(a.bufferView)].byteStride > 0)
                stride = model.bufferViews[std::size_t(a.bufferView)].byteStride;
            if (stride < size)
                REFUSE("buffer view %d has a stride of %zu bytes, less than accessor %d's elements "
                       "of %zu",
                       a.bufferView, stride, index, size);
            std::uint64_t bytes = 0;
            if (count > 0 && (__builtin_mul_overflow(std::uint64_t(count - 1), stride, &bytes) ||
                              __builtin_add_overflow(bytes, size, &bytes)))
                REFUSE("accessor %d claims %zu elements", index, count);
            base = view_bytes(model, a.bufferView, a.byteOffset, bytes, "accessor", index);
        }
        if (a.sparse.isSparse)
            open_sparse(model, a, index, size);
    }

    std::size_t count = 0; // elements

    // Element i < count, as many numbers as the type has components.
    void read(std::size_t i, double *values) const {
        const unsigned char *p = sparse_count ? sparse_element(i) : nullptr;
        if (!p)
            p = base ? base + i * stride : nullptr;
        for (int c = 0; c < components; c++)
            values[c] =
                p ? component(p + std::size_t(c) * component_size, component_type, normalized) : 0;
    }

    bool unsigned_integers() const {
        return component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
               component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
               component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    }

  private:
    void open_sparse(const tinygltf::Model &model, const tinygltf::Accessor &a, int index,
                     std::size_t size) {
        const auto &s = a.sparse;
        if (s.count < 1 || std::size_t(s.count) > count)
            REFUSE("accessor %d replaces %d of its %zu elements", index, s.count, count);
        sparse_index_type = s.indices.componentType;
        if (sparse_index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
            sparse_index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
            sparse_index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
            REFUSE("accessor %d has sparse indices of component type %d", index, sparse_index_type);
        if (s.indices.byteOffset < 0 || s.values.byteOffset < 0)
            REFUSE("accessor %d has a sparse part before the beginning of its buffer view", index);
        sparse_index_size = component_bytes(sparse_index_type);
        sparse_count = std::size_t(s.count);
        sparse_indices =
            view_bytes(model, s.indices.bufferView, std::uint64_t(s.indices.byteOffset),
                       sparse_count * sparse_index_size, "accessor", index);
        sparse_values = view_bytes(model, s.values.bufferView, std::uint64_t(s.values.byteOffset),
                                   sparse_count * size, "accessor", index);
        sparse_size = size;
        for (std::size_t i = 0; i < sparse_count; i++)
            if (sparse_index(i) >= count || (i > 0 && sparse_index(i) <= sparse_index(i - 1)))
                REFUSE("accessor %d: sparse index %zu is %llu, out of order or not below %zu",
                       index, i, (unsigned long long)sparse_index(i), count);
    }

    std::uint64_t sparse_index(std::size_t i) const {
        return std::uint64_t(
            component(sparse_indices + i * sparse_index_size, sparse_index_type, false));
    }

    const unsigned char *sparse_element(std::size_t element) const {
        std::size_t low = 0, high = sparse_count;
        while (low < high) {
            std::size_t middle = low + (high - low) / 2;
            if (sparse_index(middle) < element)
                low = middle + 1;
            else
                high = middle;
        }
        return low < sparse_count && sparse_index(low) == element
                   ? sparse_values + low * sparse_size
                   : nullptr;
    }

    const unsigned char *base = nullptr; // none: all zero
    std::size_t stride = 0, component_size = 0;
    int components = 0, component_type = 0;
    bool normalized = false;

    std::size_t sparse_count = 0, sparse_index_size = 0, sparse_size = 0;
    int sparse_index_type = 0;
    const unsigned char *sparse_indices = nullptr, *sparse_values = nullptr;
};

} // namespace pelt

#endif
