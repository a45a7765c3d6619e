function info = rtwmakecfg()
%RTWMAKECFG Tells the build of a model what sf_minimal needs; it must lie in the folder of the S-function.
folder = fileparts(mfilename('fullpath'));
info.includePath = {folder};
info.sourcePath = {folder};
info.sources = {'minimal_block.c', 'minimal.c'};
info.library = [];
end
