// A mip level of a map of thickness.
@group(0) @binding(1) var coarse: texture_storage_2d<r32float, write>;
