/* Writes what libktx finds in a KTX2 file: a line of what it is, and the bytes of each level and face to files PREFIX.LEVEL.FACE. */
#include <ktx.h>
#include <stdio.h>

int main(int count, char **names) {
    ktxTexture2 *texture;
    if (count != 3) return 2;
    ktx_error_code_e result = ktxTexture2_CreateFromNamedFile(names[1], KTX_TEXTURE_CREATE_LOAD_IMAGE_DATA_BIT, &texture);
    if (result != KTX_SUCCESS) {
        fprintf(stderr, "%s: %s\n", names[1], ktxErrorString(result));
        return 1;
    }
    printf("%s: format %u, %u x %u, %u levels, %u faces\n", names[1], texture->vkFormat, texture->baseWidth, texture->baseHeight,
           texture->numLevels, texture->numFaces);
    for (ktx_uint32_t level = 0; level < texture->numLevels; level++) {
        for (ktx_uint32_t face = 0; face < texture->numFaces; face++) {
            char name[4096];
            ktx_size_t offset, size = ktxTexture_GetImageSize(ktxTexture(texture), level);
            if (ktxTexture_GetImageOffset(ktxTexture(texture), level, 0, face, &offset) != KTX_SUCCESS) return 1;
            snprintf(name, sizeof name, "%s.%u.%u", names[2], level, face);
            FILE *file = fopen(name, "wb");
            if (!file || fwrite(ktxTexture_GetData(ktxTexture(texture)) + offset, 1, size, file) != size || fclose(file)) return 1;
        }
    }
    ktxTexture_Destroy(ktxTexture(texture));
    return 0;
}
