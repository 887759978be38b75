#include "names.h"

#include <stddef.h>
#include <string.h>
#include <vulkan/vulkan.h>

#include "json.h"

/* clang-format off */
#define NAME(constant) {#constant, constant}
static const struct { const char *name; int value; } NAMES[] = {
    NAME(VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER),
    NAME(VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE),
    NAME(VK_DESCRIPTOR_TYPE_STORAGE_IMAGE),
    NAME(VK_DESCRIPTOR_TYPE_STORAGE_BUFFER),
    NAME(VK_FORMAT_R16_SFLOAT),
    NAME(VK_FORMAT_R16G16_SFLOAT),
    NAME(VK_FORMAT_R16G16B16A16_SFLOAT),
    NAME(VK_FORMAT_R32_SFLOAT),
    NAME(VK_FORMAT_R32G32_SFLOAT),
    NAME(VK_FORMAT_R32G32B32A32_SFLOAT),
    NAME(VK_FORMAT_R32_UINT),
    NAME(VK_FORMAT_R32G32_UINT),
    NAME(VK_FORMAT_R32G32B32A32_UINT),
    NAME(VK_FORMAT_R8G8B8A8_UNORM),
};
/* clang-format on */

int vulkan_value(const char *name) {
    for (size_t i = 0; i < sizeof NAMES / sizeof *NAMES; i++) {
        if (strcmp(NAMES[i].name, name) == 0) {
            return NAMES[i].value;
        }
    }
    die("%s is not in names.c", name);
}
