function info = rtwmakecfg()
%RTWMAKECFG Tells the build of a model what sf_adc_mapping needs; it must lie in the folder of the S-function.
folder = fileparts(mfilename('fullpath'));
info.includePath = {folder};
info.sourcePath = {folder};
info.sources = {'adc_mapping_block.c', 'adc_mapping.c'};
info.library = [];
end
