// Volumes through OpenImageIO: OpenVDB, and stacks of images.
//
// OpenImageIO's OpenVDB reader takes no bytes, but a name: it is given that of a memory file, which
// no file system holds. It reads all grids when it opens, so the container is walked here first:
// versions, names, and where each grid begins and ends, which tells a file that is cut short. Its
// data window is wrong where a box begins below 0 or ends on a leaf's border, so leaves are asked
// for one by one over the display window, which is the file's own box.
//
// Left out: transforms (a tile is a box of voxels), levels of detail, grids of other types.
#ifndef PELT_RENDERER_ASSET_IMAGE_OIIO_VOLUME_H
#define PELT_RENDERER_ASSET_IMAGE_OIIO_VOLUME_H

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "renderer/asset/image_oiio_guard.h"

namespace pelt {

constexpr int leaf_side = 8, leaf_voxels = leaf_side * leaf_side * leaf_side;
constexpr uint64_t vdb_grids_max = 64, vdb_entries_max = 1024;
const char vdb_magic[] = "\x20\x42\x44\x56\0\0\0\0";

inline std::string size_fault(const std::string &name, const int64_t size[3]) {
    uint64_t voxels = 1;
    bool fits = true;
    for (int i = 0; i < 3; i++) {
        if (size[i] < 1)
            return name + " volume that is empty";
        fits = fits && size[i] <= VOLUME_FILE_SIDE_MAX;
        voxels = fits ? voxels * (uint64_t)size[i] : 0;
    }
    if (fits && voxels <= VOLUME_FILE_VOXELS_MAX)
        return "";
    return name + " volume of " + std::to_string(size[0]) + " x " + std::to_string(size[1]) +
           " x " + std::to_string(size[2]) + " voxels; at most " +
           std::to_string(VOLUME_FILE_VOXELS_MAX) + ", and " +
           std::to_string(VOLUME_FILE_SIDE_MAX) + " a side, can be read";
}

// Reads on through a file; `ok` is false from the first piece on that lies beyond its end.
struct Walk {
    const unsigned char *data;
    size_t bytes, at;
    bool ok;
    uint64_t number(int width) {
        ok = ok && bytes - at >= (size_t)width;
        uint64_t value = ok ? little(data + at, width) : 0;
        at += ok ? (size_t)width : 0;
        return value;
    }
    void skip(uint64_t count) {
        ok = ok && bytes - at >= count;
        at += ok ? (size_t)count : 0;
    }
    void text() {
        skip(number(4));
    }
};

// The container: magic, file version, library version, whether grids tell where they end, UUID,
// metadata (name, type, value), then the grids (name, type, parent, three positions).
inline std::string vdb_fault(const unsigned char *data, size_t bytes) {
    const std::string damaged = "OpenVDB file that is cut short or damaged";
    Walk walk = {data, bytes, 8, true};
    uint64_t version = walk.number(4);
    walk.skip(8);
    bool offsets = walk.number(1) != 0;
    walk.skip(36);
    if (walk.ok && (version < 222 || version > 224))
        return "OpenVDB file of version " + std::to_string(version) + "; 222 to 224 can be read";
    if (walk.ok && !offsets)
        return "OpenVDB file whose grids do not tell where they end";
    uint64_t entries = walk.number(4);
    if (entries > vdb_entries_max)
        return damaged;
    for (uint64_t i = 0; i < entries; i++) {
        walk.text();
        walk.text();
        walk.text();
    }
    uint64_t grids = walk.number(4);
    if (!walk.ok || grids > vdb_grids_max)
        return damaged;
    for (uint64_t i = 0; i < grids; i++) {
        walk.text();
        walk.text();
        walk.text();
        uint64_t from = walk.number(8), block = walk.number(8), end = walk.number(8);
        if (!walk.ok || from < walk.at || block < from || end < block || end > bytes)
            return damaged;
        walk.at = (size_t)end;
    }
    return grids ? "" : "OpenVDB file without a grid";
}

// A file in memory and its name.
struct MemoryFile {
    int fd;
    char name[64];
    MemoryFile(const unsigned char *data, size_t bytes)
        : fd(memfd_create("pelt-vdb", MFD_CLOEXEC)) {
        std::snprintf(name, sizeof name, "/proc/self/fd/%d", fd);
        for (size_t done = 0; fd >= 0 && done < bytes;) {
            ssize_t wrote = write(fd, data + done, bytes - done);
            if (wrote <= 0) {
                close(fd);
                fd = -1;
                return;
            }
            done += (size_t)wrote;
        }
    }
    ~MemoryFile() {
        if (fd >= 0)
            close(fd);
    }
    MemoryFile(const MemoryFile &) = delete;
    MemoryFile &operator=(const MemoryFile &) = delete;
};

// Which grid holds what; -1: none.
struct Grids {
    int density = -1, color = -1;
};

inline Grids find_grids(ImageInput &input) {
    Grids found;
    bool named = false;
    for (int k = 0; k < (int)vdb_grids_max; k++) {
        ImageSpec spec = input.spec(k, 0);
        if (spec.nchannels == 0 || spec.width == 0)
            break;
        std::string name = spec.get_string_attribute("oiio:subimagename");
        if (spec.nchannels == 1 && (found.density < 0 || (name == "density" && !named))) {
            found.density = k;
            named = name == "density";
        }
        if (spec.nchannels == 3 && found.color < 0 && (name == "Cd" || name == "color"))
            found.color = k;
    }
    return found;
}

inline int floor_leaf(int i) {
    return i - ((i % leaf_side) + leaf_side) % leaf_side;
}

// Copies a grid's voxels within the box into channels `first` on of voxels of `stride` floats.
inline bool read_grid(ImageInput &input, int subimage, int channels, const ImageSpec &box,
                      float *data, int first, int stride) {
    if (!input.seek_subimage(subimage, 0))
        return false;
    std::vector<float> leaf((size_t)(leaf_voxels * channels));
    int low[3] = {box.full_x, box.full_y, box.full_z};
    int high[3] = {box.full_x + box.full_width, box.full_y + box.full_height,
                   box.full_z + box.full_depth};
    for (int z = floor_leaf(low[2]); z < high[2]; z += leaf_side)
        for (int y = floor_leaf(low[1]); y < high[1]; y += leaf_side)
            for (int x = floor_leaf(low[0]); x < high[0]; x += leaf_side) {
                if (!input.read_tile(x, y, z, TypeDesc::FLOAT, leaf.data()))
                    return false;
                for (int k = 0; k < leaf_voxels; k++) {
                    int at[3] = {x + k % leaf_side, y + k / leaf_side % leaf_side,
                                 z + k / leaf_side / leaf_side};
                    bool inside = true;
                    for (int i = 0; i < 3; i++)
                        inside = inside && at[i] >= low[i] && at[i] < high[i];
                    if (!inside)
                        continue;
                    size_t row = (size_t)(at[2] - low[2]) * (size_t)box.full_height +
                                 (size_t)(at[1] - low[1]);
                    float *voxel =
                        data +
                        (row * (size_t)box.full_width + (size_t)(at[0] - low[0])) * (size_t)stride +
                        first;
                    for (int c = 0; c < channels; c++)
                        voxel[c] = leaf[(size_t)(k * channels + c)];
                }
            }
    return !input.has_error();
}

inline int vdb_checked(const unsigned char *data, size_t bytes, volume_pixels *volume,
                       char *message, size_t message_bytes) {
    std::string fault = vdb_fault(data, bytes);
    if (!fault.empty())
        return refuse(message, message_bytes, fault);
    configure();
    MemoryFile file(data, bytes);
    if (file.fd < 0)
        return no_memory(message, message_bytes, "the OpenVDB file");
    std::unique_ptr<ImageInput> input = ImageInput::create("openvdb");
    if (!input) {
        OIIO::geterror();
        return refuse(message, message_bytes, "this OpenImageIO cannot read OpenVDB");
    }
    ImageSpec spec;
    if (!input->open(file.name, spec)) {
        std::string why = reason(*input);
        return refuse(message, message_bytes,
                      "OpenVDB file that cannot be opened" + (why.empty() ? "" : ": " + why));
    }
    Grids grids = find_grids(*input);
    if (grids.density < 0)
        return refuse(message, message_bytes,
                      "OpenVDB file without a grid of floats, such as `density`");
    ImageSpec box = input->spec(grids.density, 0);
    const int64_t size[3] = {box.full_width, box.full_height, box.full_depth};
    fault = size_fault("OpenVDB", size);
    const int origin[3] = {box.full_x, box.full_y, box.full_z};
    for (int i = 0; i < 3 && fault.empty(); i++)
        if (origin[i] < -(1 << 30) || origin[i] > (1 << 30))
            fault = "OpenVDB volume that lies more than 2^30 voxels from the origin";
    if (!fault.empty())
        return refuse(message, message_bytes, fault);
    int channels = grids.color < 0 ? 1 : 4;
    Floats voxels = make_floats((size_t)(size[0] * size[1] * size[2]) * (size_t)channels);
    if (!voxels)
        return no_memory(message, message_bytes, "the OpenVDB volume");
    if (!read_grid(*input, grids.density, 1, box, voxels.get(), channels - 1, channels) ||
        (channels == 4 && !read_grid(*input, grids.color, 3, box, voxels.get(), 0, channels)))
        return refuse(message, message_bytes,
                      "OpenVDB file that is cut short or damaged: " + reason(*input));
    for (int i = 0; i < 3; i++)
        volume->size[i] = (int)size[i];
    volume->channels = channels;
    volume->data = voxels.release();
    volume->bits = 32;
    volume->is_float = volume->is_density = 1;
    return 0;
}

// Channels of a stack: weight alone, grey and weight, or colour and weight.
inline std::string channels_fault(const std::string &name, int channels) {
    if (channels == 1 || channels == 2 || channels == 4)
        return "";
    return name + " volume of " + std::to_string(channels) +
           " channels: one (opacity), two (grey, alpha) or four (RGBA) say how dense it is";
}

// The layers of a strip: from top to bottom or from left to right. Their pixels are put in order.
inline std::string cut_strip(volume_pixels *volume, Floats &pixels) {
    int width = volume->size[0], height = volume->size[1], side = std::min(width, height);
    if (width % side != 0 || height % side != 0)
        return "a flat image of " + std::to_string(width) + " x " + std::to_string(height) +
               " pixels is no volume: its layers are pages, or squares in a row or in a column";
    int layers = std::max(width, height) / side;
    volume->size[0] = volume->size[1] = side;
    volume->size[2] = layers;
    if (height >= width)
        return ""; // a column is in order as it is
    size_t channels = (size_t)volume->channels, row = (size_t)side * channels;
    Floats ordered = make_floats((size_t)width * (size_t)height * channels);
    if (!ordered)
        throw std::bad_alloc();
    for (int z = 0; z < layers; z++)
        for (int y = 0; y < side; y++)
            std::memcpy(ordered.get() + ((size_t)z * (size_t)side + (size_t)y) * row,
                        pixels.get() + ((size_t)y * (size_t)layers + (size_t)z) * row,
                        row * sizeof(float));
    pixels = std::move(ordered);
    return "";
}

// How many pages the chain of directories of a TIFF file has: a number of entries of 12 bytes each,
// then where the next one is. -1 where it leads out of the file, or round and round: the reader
// would take that for its end.
inline int tiff_pages(const unsigned char *data, size_t bytes) {
    bool swapped = data[0] == 'M';
    auto number = [&](size_t at, int width) {
        return swapped ? big(data + at, width) : little(data + at, width);
    };
    int pages = 0;
    uint64_t at = bytes < 8 ? bytes : number(4, 4);
    for (; at != 0; pages++) {
        if (pages > VOLUME_FILE_SIDE_MAX || at + 2 > bytes)
            return -1;
        uint64_t end = at + 2 + 12 * number((size_t)at, 2);
        if (end + 4 > bytes)
            return -1;
        at = number((size_t)end, 4);
    }
    return pages;
}

inline int stack_checked(const unsigned char *data, size_t bytes, volume_pixels *volume,
                         char *message, size_t message_bytes) {
    Opened opened;
    int result = open_image(data, bytes, opened, message, message_bytes);
    if (result != 0)
        return result;
    ImageInput &input = *opened.input;
    const ImageSpec first = opened.spec;
    std::string name = opened.format->name, fault = channels_fault(name, first.nchannels);
    int layers = std::string(opened.format->reader) == "tiff" ? tiff_pages(data, bytes) : 1;
    if (fault.empty() && layers < 1)
        fault = name + " volume that is cut short or damaged";
    for (int k = 1; fault.empty() && k < layers; k++) {
        if (!input.seek_subimage(k, 0)) {
            fault = name + " volume that is cut short or damaged: " + reason(input);
            break;
        }
        const ImageSpec &page = input.spec();
        if (page.width != first.width || page.height != first.height ||
            page.nchannels != first.nchannels || page.format != first.format)
            fault = name + " volume whose layer " + std::to_string(k) +
                    " has another size or format than the first";
    }
    const int64_t size[3] = {first.width, first.height, layers};
    if (fault.empty() && layers > 1)
        fault = size_fault(name, size);
    const int64_t page_pixels = (int64_t)first.width * first.height;
    if (fault.empty() && page_pixels * layers > VOLUME_FILE_VOXELS_MAX)
        fault = name + " volume of more than " + std::to_string(VOLUME_FILE_VOXELS_MAX) + " voxels";
    if (!fault.empty())
        return refuse(message, message_bytes, fault);
    size_t page_floats = (size_t)page_pixels * (size_t)first.nchannels;
    Floats pixels = make_floats(page_floats * (size_t)layers);
    if (!pixels)
        return no_memory(message, message_bytes, "the " + name + " volume");
    for (int k = 0; k < layers; k++)
        if (!input.seek_subimage(k, 0) ||
            !read_stripes(input, k, first, first.nchannels, pixels.get() + page_floats * (size_t)k))
            return refuse(message, message_bytes,
                          name + " volume that is cut short or damaged: " + reason(input));
    for (int i = 0; i < 3; i++)
        volume->size[i] = (int)size[i];
    volume->channels = first.nchannels;
    if (layers == 1)
        fault = cut_strip(volume, pixels);
    if (!fault.empty())
        return refuse(message, message_bytes, fault);
    volume->data = pixels.release();
    volume->bits = bits_of(first);
    volume->is_float = first.format.is_floating_point();
    volume->premultiplied = std::string(opened.format->reader) == "openexr";
    return 0;
}

inline int volume_checked(const unsigned char *data, size_t bytes, volume_pixels *volume,
                          char *message, size_t message_bytes) {
    bool vdb = bytes >= 8 && std::memcmp(data, vdb_magic, 8) == 0;
    return vdb ? vdb_checked(data, bytes, volume, message, message_bytes)
               : stack_checked(data, bytes, volume, message, message_bytes);
}

} // namespace pelt

#endif
