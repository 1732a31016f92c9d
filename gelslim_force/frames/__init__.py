"""Sources of frames: folders of pictures, videos, NumPy arrays, live cameras."""
