#include "gpu.h"

#include <stdio.h>
#include <string.h>

#include "json.h"

void check(VkResult result, const char *what) {
    if (result != VK_SUCCESS) {
        die("%s failed: VkResult %d", what, result);
    }
}

static const VkImageSubresourceRange WHOLE = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};

static VkPhysicalDevice find_device(VkInstance instance, const char *name) {
    VkPhysicalDevice devices[16];
    uint32_t count = 16;
    const VkResult result = vkEnumeratePhysicalDevices(instance, &count, devices);
    if (result != VK_SUCCESS && result != VK_INCOMPLETE) {
        check(result, "vkEnumeratePhysicalDevices");
    }
    for (uint32_t i = 0; i < count; i++) {
        VkPhysicalDeviceProperties properties;
        vkGetPhysicalDeviceProperties(devices[i], &properties);
        if (strstr(properties.deviceName, name) != NULL) {
            return devices[i];
        }
    }
    die("there is no Vulkan device whose name contains \"%s\"", name);
}

static uint32_t find_queue_family(VkPhysicalDevice device) {
    VkQueueFamilyProperties families[16];
    uint32_t count = 16;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families);
    for (uint32_t i = 0; i < count; i++) {
        if (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) {
            return i;
        }
    }
    die("the device has no queue with compute");
}

Gpu gpu_open(const char *name) {
    Gpu gpu = {0};
    const VkApplicationInfo application = {
        .sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_1};
    const VkInstanceCreateInfo instance_info = {
        .sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &application};
    check(vkCreateInstance(&instance_info, NULL, &gpu.instance), "vkCreateInstance");
    gpu.physical = find_device(gpu.instance, name);
    const uint32_t family = find_queue_family(gpu.physical);

    /* The one feature that the shaders need: writing rg32ui images. */
    const VkPhysicalDeviceFeatures features = {.shaderStorageImageExtendedFormats = VK_TRUE};
    const float priority = 1.0f;
    const VkDeviceQueueCreateInfo queue_info = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                                .queueFamilyIndex = family,
                                                .queueCount = 1,
                                                .pQueuePriorities = &priority};
    const VkDeviceCreateInfo device_info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                            .queueCreateInfoCount = 1,
                                            .pQueueCreateInfos = &queue_info,
                                            .pEnabledFeatures = &features};
    check(vkCreateDevice(gpu.physical, &device_info, NULL, &gpu.device), "vkCreateDevice");
    vkGetDeviceQueue(gpu.device, family, 0, &gpu.queue);
    const VkCommandPoolCreateInfo pool_info = {
        .sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, .queueFamilyIndex = family};
    check(vkCreateCommandPool(gpu.device, &pool_info, NULL, &gpu.pool), "vkCreateCommandPool");
    return gpu;
}

void gpu_close(Gpu *gpu) {
    vkDestroyCommandPool(gpu->device, gpu->pool, NULL);
    vkDestroyDevice(gpu->device, NULL);
    vkDestroyInstance(gpu->instance, NULL);
}

static VkDeviceMemory allocate(const Gpu *gpu, VkMemoryRequirements needed, VkMemoryPropertyFlags properties) {
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(gpu->physical, &memory);
    uint32_t type = 0;
    while (type < memory.memoryTypeCount
           && !((needed.memoryTypeBits >> type & 1)
                && (memory.memoryTypes[type].propertyFlags & properties) == properties)) {
        type++;
    }
    if (type == memory.memoryTypeCount) {
        die("the device has no memory for an image or buffer");
    }
    const VkMemoryAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                       .allocationSize = needed.size,
                                       .memoryTypeIndex = type};
    VkDeviceMemory allocated;
    check(vkAllocateMemory(gpu->device, &info, NULL, &allocated), "vkAllocateMemory");
    return allocated;
}

Image image_new(const Gpu *gpu, VkFormat format, uint32_t width, uint32_t height, VkImageUsageFlags usage) {
    Image image = {.size = {width, height, 1}};
    const VkImageCreateInfo info = {.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                                    .imageType = VK_IMAGE_TYPE_2D,
                                    .format = format,
                                    .extent = image.size,
                                    .mipLevels = 1,
                                    .arrayLayers = 1,
                                    .samples = VK_SAMPLE_COUNT_1_BIT,
                                    .tiling = VK_IMAGE_TILING_OPTIMAL,
                                    .usage = usage};
    check(vkCreateImage(gpu->device, &info, NULL, &image.image), "vkCreateImage");
    VkMemoryRequirements needed;
    vkGetImageMemoryRequirements(gpu->device, image.image, &needed);
    image.memory = allocate(gpu, needed, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    check(vkBindImageMemory(gpu->device, image.image, image.memory, 0), "vkBindImageMemory");
    const VkImageViewCreateInfo view = {.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
                                        .image = image.image,
                                        .viewType = VK_IMAGE_VIEW_TYPE_2D,
                                        .format = format,
                                        .subresourceRange = WHOLE};
    check(vkCreateImageView(gpu->device, &view, NULL, &image.view), "vkCreateImageView");
    return image;
}

void image_free(const Gpu *gpu, Image *image) {
    vkDestroyImageView(gpu->device, image->view, NULL);
    vkDestroyImage(gpu->device, image->image, NULL);
    vkFreeMemory(gpu->device, image->memory, NULL);
}

Buffer buffer_new(const Gpu *gpu, VkDeviceSize size, VkBufferUsageFlags usage, int is_mapped) {
    Buffer buffer = {.size = size};
    const VkBufferCreateInfo info = {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = size, .usage = usage};
    check(vkCreateBuffer(gpu->device, &info, NULL, &buffer.buffer), "vkCreateBuffer");
    VkMemoryRequirements needed;
    vkGetBufferMemoryRequirements(gpu->device, buffer.buffer, &needed);
    const VkMemoryPropertyFlags coherent = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    buffer.memory = allocate(gpu, needed, is_mapped ? coherent : VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    check(vkBindBufferMemory(gpu->device, buffer.buffer, buffer.memory, 0), "vkBindBufferMemory");
    if (is_mapped) {
        check(vkMapMemory(gpu->device, buffer.memory, 0, VK_WHOLE_SIZE, 0, &buffer.mapped), "vkMapMemory");
    }
    return buffer;
}

void buffer_free(const Gpu *gpu, Buffer *buffer) {
    vkDestroyBuffer(gpu->device, buffer->buffer, NULL);
    vkFreeMemory(gpu->device, buffer->memory, NULL);
}

VkCommandBuffer commands_begin(const Gpu *gpu) {
    const VkCommandBufferAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                              .commandPool = gpu->pool,
                                              .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                              .commandBufferCount = 1};
    VkCommandBuffer commands;
    check(vkAllocateCommandBuffers(gpu->device, &info, &commands), "vkAllocateCommandBuffers");
    const VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                            .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    check(vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
    return commands;
}

void commands_run(const Gpu *gpu, VkCommandBuffer commands) {
    check(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
    const VkSubmitInfo submit = {
        .sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1, .pCommandBuffers = &commands};
    check(vkQueueSubmit(gpu->queue, 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit");
    check(vkQueueWaitIdle(gpu->queue), "vkQueueWaitIdle");
    vkFreeCommandBuffers(gpu->device, gpu->pool, 1, &commands);
}

void barrier(VkCommandBuffer commands, VkPipelineStageFlags before, VkAccessFlags written, VkPipelineStageFlags after,
             VkAccessFlags used) {
    const VkMemoryBarrier memory = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER, .srcAccessMask = written, .dstAccessMask = used};
    vkCmdPipelineBarrier(commands, before, after, 0, 1, &memory, 0, NULL, 0, NULL);
}

void change_layout(VkCommandBuffer commands, const Image *image, VkImageLayout from, VkImageLayout to,
                   VkPipelineStageFlags before, VkAccessFlags written, VkPipelineStageFlags after, VkAccessFlags used) {
    const VkImageMemoryBarrier change = {.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER,
                                         .srcAccessMask = written,
                                         .dstAccessMask = used,
                                         .oldLayout = from,
                                         .newLayout = to,
                                         .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                         .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                         .image = image->image,
                                         .subresourceRange = WHOLE};
    vkCmdPipelineBarrier(commands, before, after, 0, 0, NULL, 0, NULL, 1, &change);
}

static VkBufferImageCopy region(uint32_t width, uint32_t height) {
    const VkBufferImageCopy copy = {.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
                                    .imageExtent = {width, height, 1}};
    return copy;
}

void upload(VkCommandBuffer commands, const Buffer *buffer, const Image *image, uint32_t width, uint32_t height) {
    const VkBufferImageCopy copy = region(width, height);
    change_layout(commands, image, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                  VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, 0, VK_PIPELINE_STAGE_TRANSFER_BIT,
                  VK_ACCESS_TRANSFER_WRITE_BIT);
    vkCmdCopyBufferToImage(commands, buffer->buffer, image->image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &copy);
    change_layout(commands, image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
                  VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                  VK_ACCESS_SHADER_READ_BIT);
}

void download(VkCommandBuffer commands, const Image *image, const Buffer *buffer, uint32_t width, uint32_t height) {
    const VkBufferImageCopy copy = region(width, height);
    vkCmdCopyImageToBuffer(commands, image->image, VK_IMAGE_LAYOUT_GENERAL, buffer->buffer, 1, &copy);
    barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT, VK_PIPELINE_STAGE_HOST_BIT,
            VK_ACCESS_HOST_READ_BIT);
}
