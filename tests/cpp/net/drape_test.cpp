int placeholder_drape();
